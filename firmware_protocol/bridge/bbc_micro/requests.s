; Which request is refused, and for what reason first: opcode, ability, length, values, address, session, order, state.

.include "protocol.inc"
.importzp entry, count, scratch
.import body, refuse, reply_to_body, send_reply, judge_stamp
.import hello, read_block, write_block, write_set_points, report_gains, set_gains, report_all, sample, move_and_sample
.import stop_arm, release
.import read_process, write_outputs, set_gripper, read_status

.export handle_request, count_joints

OWN = $FF                       ; the check looks at the length itself
READ = 0
COMMAND = 1
UNABLE = 2
PAYLOAD = body+4
STAMPED = body+12               ; what follows the stamp of a command

.macro request opcode, kind, length, check, handler
        .byte opcode, kind, length
        .word check-1, handler-1
.endmacro

.rodata

table:
        request HELLO, READ, OWN, check_hello, hello
        request READ_BLOCK, READ, 3, check_read_block, read_block
        request WRITE_BLOCK, COMMAND, OWN, check_write_block, write_block
        request WRITE_SET_POINTS, COMMAND, OWN, check_set_points, write_set_points
        request REPORT_GAINS, READ, 0, check_nothing, report_gains
        request SET_GAINS, COMMAND, 12, check_gains, set_gains
        request REPORT_ALL, READ, 1, check_mask, report_all
        request SAMPLE, READ, 5, check_sample, sample
        request MOVE_AND_SAMPLE, COMMAND, OWN, check_turn, move_and_sample
        request STOP, READ, 0, check_nothing, stop_arm
        request RELEASE, COMMAND, 12, check_nothing, release
        request READ_PROCESS, READ, 0, check_nothing, read_process
        request WRITE_OUTPUTS, COMMAND, 10, check_nothing, write_outputs
        request SET_GRIPPER, COMMAND, 9, check_gripper, set_gripper
        request READ_STATUS, READ, 0, check_nothing, read_status
        request ADVANCE, UNABLE, OWN, check_nothing, check_nothing
        .byte 0
ENTRY_BYTES = 7

.code

handle_request:
        ldx #0
find:   lda table,x
        beq unknown
        cmp body+3
        beq found
        txa
        clc
        adc #ENTRY_BYTES
        tax
        bne find
unknown:
        lda #UNKNOWN_OPCODE
        jmp refuse
found:  stx entry
        lda table+1,x
        cmp #UNABLE
        bne able
        lda #NOT_CAPABLE
        jmp refuse
able:   lda table+2,x
        cmp #OWN
        beq right_length
        cmp body
        beq right_length
        lda #BAD_LENGTH
        jmp refuse
right_length:
        jsr check
        beq understood
        jmp refuse
understood:
        ldx entry
        lda table+1,x
        beq obey
        jsr judge_stamp
        beq obey
        jmp refuse
obey:   jsr reply_to_body
        jsr carry_out           ; A: 0, a reason of refusal, or FF for no reply now
        beq answer
        bmi nothing
        jmp refuse
answer: jmp send_reply
nothing:
        rts

check:  ldx entry
        lda table+4,x
        pha
        lda table+3,x
        pha
        rts

carry_out:
        ldx entry
        lda table+6,x
        pha
        lda table+5,x
        pha
        rts

; ---- checks: A is the reason of refusal, 0 for none

check_nothing:
        lda #0
        rts

; Of another version nothing is asked but its number.
check_hello:
        lda body
        beq check_nothing
        lda PAYLOAD
        cmp #VERSION
        bne check_nothing
        lda body
        cmp #5
        beq check_nothing
wrong_length:
        lda #BAD_LENGTH
        rts

check_read_block:
        lda PAYLOAD+2
        beq wrong_value
        cmp #MOST_PAYLOAD+1
        bcs wrong_value
        sta count
        ldx PAYLOAD
        lda PAYLOAD+1
        jmp check_address

check_write_block:
        lda body
        sec
        sbc #10                 ; stamp and address
        bcc wrong_length
        beq wrong_length
        sta count
        ldx STAMPED
        lda STAMPED+1

; `count` bytes from the address in X (low) and A.
check_address:
        cmp #>$FC00
        bne wrong_address
        txa
        clc
        adc count
        bcs wrong_address
        cmp #$81
        bcc check_nothing
wrong_address:
        lda #BAD_ADDRESS
        rts

check_mask:
        lda PAYLOAD
check_mask_in_a:
        beq wrong_value
        cmp #$40
        bcc check_nothing
wrong_value:
        lda #BAD_VALUE
        rts

check_sample:
        lda PAYLOAD+4
        jmp check_mask_in_a

check_set_points:
        lda body
        cmp #9
        bcc wrong_length
        lda STAMPED
        jsr check_mask_in_a
        bne checked
        lda STAMPED
        ldx #0

; The set points of the joints in the mask in A, which stand from STAMPED+1+X to the end of the payload.
check_values:
        stx scratch
        jsr count_joints
        asl a
        adc scratch
        sta count               ; where X is after the last
        adc #9
        cmp body
        bne wrong_length
        ldx scratch
each:   lda STAMPED+2,x         ; 999 is 03E7
        cmp #3
        bcc low_enough
        bne wrong_value
        lda STAMPED+1,x
        cmp #$E8
        bcs wrong_value
low_enough:
        inx
        inx
        cpx count
        bne each
        lda #0
checked:
        rts

check_gains:
        lda STAMPED
        beq wrong_value
        cmp #JOINTS+1
        bcs wrong_value
        ldx #2
gain:   lda STAMPED+1,x
        cmp #21
        bcs wrong_value
        dex
        bpl gain
        lda #0
        rts

check_gripper:
        lda STAMPED
        cmp #2
        bcs wrong_value
        lda #0
        rts

; A question (tick and mask), then set points as in WriteSetPoints, or a mask of 0 and none.
check_turn:
        lda body
        cmp #14
        bcs long_enough
        jmp wrong_length
long_enough:
        lda STAMPED+4
        jsr check_mask_in_a
        bne told
        lda STAMPED+5
        beq no_points
        jsr check_mask_in_a
        bne told
        lda STAMPED+5
        ldx #5
        jmp check_values
no_points:
        lda body
        cmp #14
        beq checked_turn
        jmp wrong_length
checked_turn:
        lda #0
told:   rts

; Number of joints in the mask in A, in A; carry is clear.
count_joints:
        ldx #0
bit_:   lsr a
        bcc none
        inx
none:   bne bit_
        txa
        clc
        rts
