; From counts to posture units, by the rounding rule: (2 * counts * 1000 + 4096) div 8192, at most 999.

.importzp product, scratch

.export to_posture

.code

; Counts (0 to 4095) in `product`, two bytes, become posture units. It is (125 * counts + 256) div 512, and 125 = 128 - 3.
; Keeps X and Y.
to_posture:
        lda product
        sta scratch
        lda product+1
        sta scratch+1
        sta product+2
        lda product
        sta product+1
        lda #0
        sta product
        lsr product+2
        ror product+1
        ror product             ; 128 * counts
        jsr subtract
        jsr subtract
        jsr subtract
        inc product+1           ; + 256
        bne shift
        inc product+2
shift:  lsr product+2
        lda product+1
        ror a
        sta product
        lda product+2
        sta product+1
        cmp #3                  ; 999 is 03E7
        bcc small
        lda product
        cmp #$E8
        bcc small
        lda #$E7
        sta product
small:  rts

subtract:
        lda product
        sec
        sbc scratch
        sta product
        lda product+1
        sbc scratch+1
        sta product+1
        bcs kept
        dec product+2
kept:   rts
