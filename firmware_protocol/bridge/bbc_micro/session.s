; Greetings, sessions, stamps, and numbers that were never used before.

.include "protocol.inc"
.include "machine.inc"
.include "long.inc"
.importzp session, nonce, newest, fresh, seeded, restarted, boots, crc_low, crc_high
.import body, put, put_long, crc_begin, crc_add

.export hello, judge_stamp, next_number, end_session

STAMP = body+4

.code

hello:
        lda body
        beq other_version
        lda body+4
        cmp #VERSION
        bne other_version
        test_long session
        beq new
        equal_long body+5, nonce
        beq greeted             ; a repeat changes nothing
new:    jsr next_number
        copy_long fresh, session
        copy_long body+5, nonce
        clear_long newest
        inc newest
        lda #0
        sta restarted
greeted:
        jsr about
        ldx #nonce
        jsr put_long
        ldx #session
        jsr put_long
        lda #0
        rts

; In the form of version 1, which every host understands.
other_version:
        jsr about
        lda #0
        rts

about:  ldy #0
each:   lda constants,y
        jsr put
        iny
        cpy #8
        bne each
        lda boots
        jsr put
        lda boots+1
        jmp put

.rodata
constants:
        .byte VERSION
        .word CAPABLE_OF
        .dword PERIOD_US
        .byte RING_DEPTH
.code

; A: 0 for a command of the present session that is not older than the newest, else the reason of refusal.
judge_stamp:
        test_long session
        beq foreign
        equal_long STAMP, session
        bne foreign
        compare_long STAMP+4, newest
        bcc old
        copy_long STAMP+4, newest
        lda #0
        rts
foreign:
        lda #BAD_SESSION
        rts
old:    lda #STALE
        rts

end_session:
        clear_long session
        rts

; Counts `fresh` up, to a number that no session and no stop has had. The first one comes from the moment at which
; somebody has started the bridge, in microseconds since the machine was switched on, mixed by two CRCs. They have
; polynomials without a common factor, so together they are as good as one of 32 bits; with one polynomial, the second
; would differ from the first by a constant.
next_number:
        lda seeded
        bne counted
        inc seeded
        jsr crc_begin
        jsr mix
        lda crc_low
        sta fresh
        lda crc_high
        sta fresh+1
counted:
        increment_long fresh
        test_long fresh
        beq counted             ; 0 stands for none
        rts

mix:    ldx #4
tick:   lda CLOCK,x
        jsr add_to_both
        dex
        bpl tick
        lda SYSTEM_VIA_T1
        jsr add_to_both
        lda SYSTEM_VIA_T1+1
        jsr add_to_both
        lda USER_VIA_T1_LOW

; Adds the byte in A to the CRC, and to that with the polynomial 8BB7 in the high half of `fresh`. Keeps X.
add_to_both:
        pha
        jsr crc_add
        pla
        eor fresh+3
        sta fresh+3
        ldy #8
bit_:   asl fresh+2
        rol fresh+3
        bcc even
        lda fresh+2
        eor #$B7
        sta fresh+2
        lda fresh+3
        eor #$8B
        sta fresh+3
even:   dey
        bne bit_
        rts
