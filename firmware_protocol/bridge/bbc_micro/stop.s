; Stop: set points become the measured posture, and are held until the release that names the newest stop.

.include "protocol.inc"
.include "memory_map.inc"
.include "long.inc"
.importzp frozen, frozen_tick, fresh, stop, begun, count, scratch, product, joint, following, ring_count, ring_newest
.importzp ring_pointer, written_tick, now, tick, mask, read_once
.import body, put, put_long, next_number, frozen_postures, fresh_reading, held, read_all, wait_until_clear, find_begun
.import ring_place, begin_2_ms, end_2_ms, to_posture, next_reading

.export stop_arm, release, begin_frozen, same_reading

STAMPED = body+12
MOST_READINGS = 4

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
        jsr next_joint
        bne note
        rts

; Puts positions into `fresh_reading`: of the newest snapshot, if it is of the latest complete period or, while that is
; being read, of the one before; an older one would drive the arm back. Else of readings 2 ms apart, until all joints
; agree in two that follow each other. That takes four in a sound memory; after four, whatever they say, each joint has
; what two readings in a row agreed on last, or the newest.
measure:
        lda following
        beq read_anew
        lda ring_count
        beq read_anew
        copy_long ring_newest, begun
        equal_long begun, tick
        beq current
        increment_long begun
        equal_long begun, tick
        bne read_anew
        copy_long ring_newest, begun
current:
        jsr ring_place          ; of the tick in `begun`
        ldy #42
copy:   lda (ring_pointer),y
        sta fresh_reading-1,y
        dey
        bne copy
        rts

read_anew:
        lda #0
        sta read_once           ; `held` is not the first reading of a snapshot any more
        sta mask                ; joints on which two readings in a row have agreed
        lda #MOST_READINGS-1
        sta count
        jsr begin_2_ms
        jsr read_positions
again:  ldx #41
keep:   lda fresh_reading,x
        sta held,x
        dex
        bpl keep
        jsr end_2_ms
        jsr wait_until_clear
        jsr begin_2_ms
        jsr read_positions
        jsr compare_positions
        beq agreed
        dec count
        bne again
agreed: ldx #0
        ldy #0
take:   lda frozen_postures,y
        sta fresh_reading+2,x
        lda frozen_postures+1,y
        sta fresh_reading+3,x
        jsr next_joint
        bne take
        rts

; From one joint to the next: Y among pairs of bytes, X among readings. Zero flag: that was the last.
next_joint:
        iny
        iny
        jmp next_reading

; Reads the positions alone into `fresh_reading`.
read_positions:
        ldx #0
        ldy #0
position:
        lda POSITION_LOW,x
        sta fresh_reading+2,y
        lda POSITION_HIGH,x
        and #$0F
        sta fresh_reading+3,y
        tya
        clc
        adc #7
        tay
        inx
        cpx #JOINTS
        bne position
        rts

; Zero flag: the positions in `fresh_reading` and `held` agree. Notes in `frozen_postures` what to freeze by now.
compare_positions:
        lda #0
        sta scratch             ; joints that differ
        tax
        tay
        lda #1
        sta joint               ; its bit in the mask
each_joint:
        lda fresh_reading+2,x
        cmp held+2,x
        bne differs
        lda fresh_reading+3,x
        cmp held+3,x
        bne differs
        lda mask
        ora joint
        sta mask
        bne note_position
differs:
        inc scratch
        lda mask
        and joint
        bne go_on
note_position:
        lda fresh_reading+2,x
        sta frozen_postures,y
        lda fresh_reading+3,x
        sta frozen_postures+1,y
go_on:  asl joint
        jsr next_joint
        bne each_joint
        lda scratch
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
        jsr next_reading
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
        jsr next_reading
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
        jsr read_all
        jmp note_postures
