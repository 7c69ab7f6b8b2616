; The shared memory: whole readings, blocks, set points, gains, inputs and outputs.

.include "protocol.inc"
.include "memory_map.inc"
.include "long.inc"
.importzp count, scratch, pointer, mask, frozen, restarted, begun, written_tick, stop, boots, missed
.import body, reply, put, put_long, fresh_reading, wait_until_clear, find_begun, send_reply

.export read_all, read_block, write_block, write_set_points, write_points, report_gains, set_gains, report_all
.export next_reading, read_process, write_outputs, set_gripper, read_status, put_status, put_readings

STAMPED = body+12

.code

; Reads seven bytes of every joint into `fresh_reading`, byte by byte: torn, unless a second reading agrees.
read_all:
        ldx #0
        ldy #0
each:   lda SET_POINT_LOW,x
        sta fresh_reading,y
        iny
        lda SET_POINT_HIGH,x
        and #$03
        sta fresh_reading,y
        iny
        lda POSITION_LOW,x
        sta fresh_reading,y
        iny
        lda POSITION_HIGH,x
        and #$0F
        sta fresh_reading,y
        iny
        lda ERROR_LOW,x
        sta fresh_reading,y
        iny
        lda ERROR_HIGH,x
        sta fresh_reading,y
        iny
        lda POWER,x
        sta fresh_reading,y
        iny
        inx
        cpx #JOINTS
        bne each
        rts

; From one reading of seven bytes to the next: X. Zero flag: that was the last.
next_reading:
        txa
        clc
        adc #7
        tax
        cpx #7 * JOINTS
        rts

read_block:
        jsr wait_until_clear
        ldy body+4
        lda body+6
        sta count
next:   lda MEMORY,y
        jsr put
        iny
        dec count
        bne next
        lda #0
        rts

write_block:
        lda body
        sec
        sbc #10
        sta count
        lda frozen
        beq allowed
        lda STAMPED             ; set points are at 00 to 05 and 08 to 0D
        cmp #$0E
        bcs allowed
        cmp #$06
        bcc is_frozen
        cmp #$08
        bcs is_frozen
        adc count
        cmp #$09
        bcs is_frozen
allowed:
        jsr wait_until_clear
        ldy STAMPED
        ldx #0
write:  lda STAMPED+2,x
        sta MEMORY,y
        iny
        inx
        cpx count
        bne write
        jsr note_written
        lda #0
        rts
is_frozen:
        lda #IS_FROZEN
        rts

write_set_points:
        lda frozen
        bne is_frozen
        lda STAMPED
        ldx #0
        jsr write_points
        jsr put_tick_and_status
        lda #0
        rts

; Writes the set points of the joints in the mask in A, which stand at STAMPED+1+X. In `begun`: the last period that has
; begun before they were written.
write_points:
        sta mask
        stx count
        jsr wait_until_clear
        ldx count               ; of the values
        ldy #0                  ; of the joint
point:  lsr mask
        bcc not_this
        lda STAMPED+1,x
        sta SET_POINT_LOW,y
        lda STAMPED+2,x
        sta SET_POINT_HIGH,y
        inx
        inx
not_this:
        iny
        cpy #JOINTS
        bne point

note_written:
        jsr find_begun
        copy_long begun, written_tick
        rts

; The last period that has begun, and the flags.
put_tick_and_status:
        jsr find_begun
        ldx #begun
        jsr put_long
put_status:
        lda frozen
        ora restarted
        jmp put

read_status:
        jsr put_tick_and_status
        lda boots
        jsr put
        lda boots+1
        jsr put
        ldx #missed
        jsr put_long
        ldx #stop
        jsr put_long
        lda #0
        rts

report_gains:
        jsr wait_until_clear
        ldy #0
of:     lda GAIN_P,y
        jsr put
        lda GAIN_I,y
        jsr put
        lda GAIN_D,y
        jsr put
        iny
        cpy #JOINTS
        bne of
        lda #0
        rts

set_gains:
        jsr wait_until_clear
        ldy STAMPED
        lda STAMPED+1
        sta GAIN_P-1,y
        lda STAMPED+2
        sta GAIN_I-1,y
        lda STAMPED+3
        sta GAIN_D-1,y
        lda #0
        rts

report_all:
        jsr wait_until_clear
        jsr read_all
        lda body+4
        sta mask
        jsr put
        lda #<fresh_reading
        ldx #>fresh_reading

; Adds the readings of the joints in `mask` from the 42 bytes at A (low) and X.
put_readings:
        sta pointer
        stx pointer+1
        ldy #0
reading:
        lsr mask
        bcc skip
        lda #7
        sta count
value:  lda (pointer),y
        jsr put
        iny
        dec count
        bne value
        beq following_joint
skip:   tya
        clc
        adc #7
        tay
following_joint:
        cpy #7 * JOINTS
        bne reading
        lda #0
        rts

read_process:
        jsr wait_until_clear
        lda INPUTS
        jsr put
        lda OUTPUTS
        jsr put
        lda GRIPPER
        and #1
        jsr put
        lda #0
        rts

; Outputs in the mask take their values, the others stay: old eor ((old eor values) and mask).
write_outputs:
        jsr wait_until_clear
        lda OUTPUTS
        eor STAMPED+1
        and STAMPED
        eor OUTPUTS
        sta OUTPUTS
        lda #0
        rts

set_gripper:
        jsr wait_until_clear
        lda STAMPED
        sta GRIPPER
        lda #0
        rts
