; Stop: set points become the measured posture, and are held until the release that names the newest stop.

.include "protocol.inc"
.include "memory_map.inc"
.include "long.inc"
.importzp frozen, frozen_tick, fresh, stop, begun, count, scratch, product, joint, following, ring_count, ring_newest
.importzp ring_pointer, written_tick, now
.import body, put, put_long, next_number, frozen_postures, fresh_reading, held, read_all, wait_until_clear, find_begun
.import ring_place, wait_2_ms, to_posture

.export stop_arm, release, begin_frozen, same_reading

STAMPED = body+12

.code

stop_arm:
        jsr next_number
        copy_long fresh, stop
        lda frozen
        bne held_already
        lda #FLAG_FROZEN
        sta frozen
        jsr measure
        jsr freeze
        jsr find_begun
        copy_long begun, frozen_tick
        copy_long begun, written_tick
held_already:
        ldx #frozen_tick
        jsr put_long
        ldy #0
each:   lda frozen_postures,y
        jsr put
        iny
        cpy #2 * JOINTS
        bne each
        lda #0
        rts

release:
        equal_long STAMPED, stop
        bne other
        lda #0
        sta frozen
        rts
other:  lda #OTHER_STOP
        rts

; The bridge keeps nothing while it has no supply, so it begins with the set points that it finds, frozen.
begin_frozen:
        jsr next_number
        copy_long fresh, stop
        lda #FLAG_FROZEN
        sta frozen
        jsr read_all

; The set points in `fresh_reading` are those that are held.
note_postures:
        ldx #0
        ldy #0
note:   lda fresh_reading,x
        sta frozen_postures,y
        lda fresh_reading+1,x
        sta frozen_postures+1,y
        iny
        iny
        txa
        clc
        adc #7
        tax
        cpx #7 * JOINTS
        bne note
        rts

; Puts whole positions into `fresh_reading`: of the newest complete period, else of two readings that agree, 2 ms apart.
measure:
        lda following
        beq read_anew
        lda ring_count
        beq read_anew
        copy_long ring_newest, begun
        jsr ring_place          ; of the tick in `begun`
        ldy #42
copy:   lda (ring_pointer),y
        sta fresh_reading-1,y
        dey
        bne copy
        rts
read_anew:
        jsr read_all
again:  ldx #41
keep:   lda fresh_reading,x
        sta held,x
        dex
        bpl keep
        jsr wait_2_ms
        jsr read_all
        jsr same_reading
        bne again
        rts

; Zero flag: the positions, errors and powers of `fresh_reading` and `held` agree, and the set points as well.
same_reading:
        ldx #41
compare:
        lda fresh_reading,x
        cmp held,x
        bne differ
        dex
        bpl compare
        lda #0
differ: rts

; Set points := positions. A memory in which all positions are 0 has no supply: there is nothing to write then.
freeze:
        ldx #0
        stx scratch
look:   lda fresh_reading+2,x
        ora fresh_reading+3,x
        ora scratch
        sta scratch
        txa
        clc
        adc #7
        tax
        cpx #7 * JOINTS
        bne look
        lda scratch
        beq no_supply
        ldx #0
convert:
        lda fresh_reading+2,x
        sta product
        lda fresh_reading+3,x
        sta product+1
        jsr to_posture
        lda product
        sta fresh_reading,x
        lda product+1
        sta fresh_reading+1,x
        txa
        clc
        adc #7
        tax
        cpx #7 * JOINTS
        bne convert
        jsr note_postures
        jsr wait_until_clear
        ldx #0
        ldy #0
write:  lda frozen_postures,y
        sta SET_POINT_LOW,x
        lda frozen_postures+1,y
        sta SET_POINT_HIGH,x
        iny
        iny
        inx
        cpx #JOINTS
        bne write
        rts
no_supply:
        jmp note_postures
