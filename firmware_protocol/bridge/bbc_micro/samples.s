; The ring of snapshots, and the Sample that waits for one.

.include "protocol.inc"
.include "long.inc"
.importzp tick, ring_newest, ring_count, ring_pointer, sampling, sample_sequence, sample_after, sample_mask, sample_begun
.importzp sample_mark, begun, oldest, product, scratch, frozen, restarted, missed, missed_one, written_tick, mask, now
.importzp reply_bytes, count, sample_opcode, taken
.import body, reply, fresh_reading, snapshots, put, put_long, put_readings, send_reply, write_points, find_begun
.import to_posture, read_now, next_reading

.export keep_snapshot, ring_place, sample, move_and_sample, sample_work

MISSING = $80                   ; status of a place whose period has no snapshot; no flag has this value
PATIENCE = 25                   ; periods after which a Sample has waited in vain

.code

; `ring_pointer` becomes the place of the tick in `begun`: one of 64 places of 64 bytes.
ring_place:
        lda begun
        lsr a
        ror ring_pointer        ; two bits of the tick come in from above
        lsr a
        ror ring_pointer
        and #RING_DEPTH / 4 - 1
        clc
        adc #>snapshots
        sta ring_pointer+1
        lda ring_pointer
        and #$C0
        sta ring_pointer
        rts

; Puts the whole reading in `fresh_reading` into the ring, under the tick of the period that it shows.
keep_snapshot:
        jsr put_in_taken
        lda ring_count
        beq follows
        jsr mark_missing
follows:
        copy_long tick, ring_newest
        copy_long tick, begun
        jsr take_place
        jsr ring_place
        ldy #42
store:  lda fresh_reading-1,y
        sta (ring_pointer),y
        dey
        bne store
        lda missed_one
        beq none_missed
        increment_long missed
        lda #FLAG_MISSED
none_missed:
        ora frozen
        ldy #0
        sta (ring_pointer),y
        rts

; One more place of the ring is taken.
take_place:
        lda ring_count
        cmp #RING_DEPTH
        beq full
        inc ring_count
full:   rts

; Periods between the newest in the ring and this one have no snapshot, but places. Where they are more than the ring
; has, it is emptied.
mark_missing:
        sec
        lda tick
        sbc ring_newest
        sta scratch
        lda tick+1
        sbc ring_newest+1
        sta scratch+1
        lda tick+2
        sbc ring_newest+2
        ora scratch+1
        sta scratch+1
        lda tick+3
        sbc ring_newest+3
        ora scratch+1
        bne empty
        lda scratch
        beq empty
        cmp #RING_DEPTH+1
        bcs empty
        copy_long ring_newest, begun
mark:   increment_long begun
        dec scratch
        beq marked
        jsr ring_place
        ldy #0
        lda #MISSING
        sta (ring_pointer),y
        jsr take_place
        jmp mark
empty:  lda #0
        sta ring_count
marked: rts

; The set points that the controller took are what position + error come to. They are not those in the memory where it
; has missed some, or where others were written since.
put_in_taken:
        lda #0
        sta missed_one
        tax
each:   lda fresh_reading+2,x
        clc
        adc fresh_reading+4,x
        sta product
        lda fresh_reading+3,x
        adc fresh_reading+5,x
        sta product+1
        bmi below
        cmp #$10
        bcc within
        lda #$FF
        sta product
        lda #$0F
        bne set
below:  lda #0
        sta product
set:    sta product+1
within: jsr to_posture
        jsr note_missed
        lda product
        sta fresh_reading,x
        lda product+1
        sta fresh_reading+1,x
        jsr next_reading
        bne each
        rts

; Whether the memory holds a valid set point that was there before this period, and that it has not taken.
note_missed:
        compare_long written_tick, tick
        bcs not_missed
        lda fresh_reading+1,x
        cmp product+1
        bne differs
        lda fresh_reading,x
        cmp product
        beq not_missed
differs:
        lda fresh_reading,x
        cmp #<1000
        lda fresh_reading+1,x
        sbc #>1000
        bcs not_missed
        inc missed_one
not_missed:
        rts

; Set points, if there are any, and then a Sample with a compact answer.
move_and_sample:
        jsr find_begun
        lda body+17
        beq question
        lda frozen
        beq move
        lda #IS_FROZEN
        rts
move:   lda body+17
        ldx #5
        jsr write_points
question:
        lda begun
        sta taken
        lda body+16
        sta sample_mask
        copy_long body+12, sample_after
        lda #MOVE_AND_SAMPLE
        bne begin_waiting

sample: lda body+8
        sta sample_mask
        copy_long body+4, sample_after
        lda #SAMPLE

; A later question takes the place of one that waits.
begin_waiting:
        sta sample_opcode
        lda body+1
        sta sample_sequence
        lda body+2
        sta sample_sequence+1
        lda #1
        sta sampling
        lda #PATIENCE
        sta sample_begun
        jsr read_now
        lda now
        sta sample_mark
        lda now+1
        sta sample_mark+1
        lda ring_count
        bne known
        clear_long sample_after
        beq later
known:  compare_long sample_after, ring_newest
        bcc later
        copy_long ring_newest, sample_after
later:  jsr sample_work
        lda #$FF                ; the reply has been sent, or will be
        rts

; Answers the Sample that waits with the oldest snapshot after `sample_after`.
sample_work:
        lda sampling
        bne asked
        rts
asked:  lda ring_count
        beq none_new
        compare_long sample_after, ring_newest
        bcc some
none_new:
        jmp wait
some:
        copy_long ring_newest, oldest
        lda ring_count          ; oldest := newest - count + 1
        sec
        sbc #1
        sta scratch
        lda oldest
        sec
        sbc scratch
        sta oldest
        lda oldest+1
        sbc #0
        sta oldest+1
        lda oldest+2
        sbc #0
        sta oldest+2
        lda oldest+3
        sbc #0
        sta oldest+3
        copy_long sample_after, begun
        increment_long begun
        compare_long begun, oldest
        bcs in_ring
        copy_long oldest, begun
in_ring:
        jsr ring_place
        ldy #0
        lda (ring_pointer),y
        bpl there
        increment_long begun    ; the newest is never missing
        jmp in_ring
there:  jmp answer

wait:   jsr read_now
        lda now
        sec
        sbc sample_mark
        sta scratch
        lda now+1
        sbc sample_mark+1
        sta scratch+1
        lda scratch
        cmp #<PERIOD_US
        lda scratch+1
        sbc #>PERIOD_US
        bcc go_on
        lda now
        sta sample_mark
        lda now+1
        sta sample_mark+1
        dec sample_begun
        beq in_vain
go_on:  rts

in_vain:
        jsr begin
        lda #REFUSED
        sta reply+3
        lda sample_opcode
        jsr put
        lda #NOTHING_NEW
        jsr put
        jmp send_reply

begin:  lda #0
        sta sampling
        sta reply_bytes
        lda sample_sequence
        sta reply+1
        lda sample_sequence+1
        sta reply+2
        rts

answer: jsr begin
        lda sample_opcode
        ora #$80
        sta reply+3
        ldx #begun
        jsr put_long
        jsr ring_place
        ldy #0
        lda (ring_pointer),y
        ora restarted
        jsr put
        lda sample_opcode
        cmp #MOVE_AND_SAMPLE
        beq compact
        lda sample_mask
        sta mask
        jsr put
        ldx ring_pointer+1
        lda ring_pointer
        clc
        adc #1
        jsr put_readings
        jmp send_reply

; Four bytes per joint: position and error in twelve bits each, then power.
compact:
        lda taken
        jsr put
        lda sample_mask
        sta mask
        jsr put
        ldy #1
reading:
        lsr mask
        bcc skip
        iny
        iny
        lda (ring_pointer),y    ; position
        jsr put
        iny
        lda (ring_pointer),y
        sta scratch
        iny
        jsr twelve_bits         ; error, in `product`
        lda product
        asl a
        asl a
        asl a
        asl a
        ora scratch
        jsr put
        ldx #4
shift:  lsr product+1
        ror product
        dex
        bne shift
        lda product
        jsr put
        iny
        lda (ring_pointer),y    ; power
        jsr put
        iny
        bne next
skip:   tya
        clc
        adc #7
        tay
next:   cpy #1 + 7 * JOINTS
        bne reading
        jmp send_reply

; The error at Y and Y+1 of the place, or the nearest that twelve bits hold. Leaves Y at its high byte.
twelve_bits:
        lda (ring_pointer),y
        sta product
        iny
        lda (ring_pointer),y
        sta product+1
        bmi negative
        cmp #$08
        bcc fits
        lda #$FF
        sta product
        lda #$07
        sta product+1
        rts
negative:
        cmp #$F8
        bcs fits
        lda #0
        sta product
        lda #$F8
        sta product+1
fits:   rts
