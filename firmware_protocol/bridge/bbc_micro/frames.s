; Frames: bytes between zeros become a request in `body`; a reply in `reply` becomes bytes on the line.

.include "protocol.inc"
.importzp rx_in, rx_out, tx_in, tx_out, received, too_long, reply_bytes, code_at, code, count, scratch
.importzp crc_low, crc_high
.import rx_ring, tx_ring, body, reply, crc_begin, crc_add, begin_sending, handle_request

.export take_bytes, reply_to_body, put, put_long, send_reply, refuse

MOST_WAITING = 256 - 64         ; bytes to be sent beyond which no further request is taken: a reply would not fit

.code

; Takes what has come, up to the end of one frame.
take_bytes:
        lda tx_in
        sec
        sbc tx_out
        cmp #MOST_WAITING
        bcs taken
        ldx rx_out
        cpx rx_in
        beq taken
        lda rx_ring,x
        inc rx_out
        cmp #0
        beq delimiter
        ldx received
        cpx #MOST_ENCODED
        bcs drop
        sta body,x
        inc received
        jmp take_bytes
drop:   sta too_long            ; anything but 0
        jmp take_bytes
taken:  rts

delimiter:
        ldx received
        ldy too_long
        lda #0
        sta received
        sta too_long
        cpy #0
        bne take_bytes
        cpx #0
        beq take_bytes          ; two zeros follow each other between frames
        jsr unstuff
        bcs take_bytes
        jsr check_frame
        bcs take_bytes
        jmp handle_request

; Undoes the stuffing of X bytes in place; X: bytes that are left. Carry: it does not come out even.
unstuff:
        stx count
        ldx #0                  ; from
        ldy #0                  ; to
        lda #0
        sta code                ; bytes until the next code
byte:   lda code
        bne plain
        lda body,x
        sta code
        cpx #0
        beq next                ; the first code stands for no zero
        lda #0
        beq store
plain:  lda body,x
store:  sta body,y
        iny
next:   dec code
        inx
        cpx count
        bne byte
        tya
        tax
        lda code
        cmp #1                  ; carry unless 0
        rts

; Carry unless the X bytes in `body` are a whole frame: 6 at least, the stated length, and a CRC of 0 over all.
check_frame:
        cpx #6
        bcc broken
        stx count
        lda body
        clc
        adc #6
        cmp count
        bne broken
        cmp #MOST_PAYLOAD + 7
        bcs broken
        jsr crc_begin
        ldx #0
sum:    lda body,x
        jsr crc_add
        inx
        cpx count
        bne sum
        lda crc_low
        ora crc_high
        cmp #1
        rts
broken: sec
        rts

; Begins the reply to the request in `body`.
reply_to_body:
        lda body+1
        sta reply+1
        lda body+2
        sta reply+2
        lda body+3
        ora #$80
        sta reply+3
        lda #0
        sta reply_bytes
        rts

; Adds the byte in A to the reply. Keeps A and Y; X is lost.
put:    ldx reply_bytes
        sta reply+4,x
        inc reply_bytes
        rts

; Adds four bytes of the zero page from address X on. Y is lost.
put_long:
        ldy #4
more:   lda $00,x
        stx scratch
        jsr put
        ldx scratch
        inx
        dey
        bne more
        rts

; Refuses the request in `body` for the reason in A.
refuse:
        pha
        jsr reply_to_body
        lda body+3
        jsr put
        pla
        jsr put
        lda #REFUSED
        sta reply+3

; Puts the reply on the line.
send_reply:
        lda reply_bytes
        sta reply
        clc
        adc #4
        sta count
        jsr crc_begin
        ldx #0
each:   lda reply,x
        jsr crc_add
        inx
        cpx count
        bne each
        lda crc_high
        sta reply,x
        lda crc_low
        sta reply+1,x
        inx
        inx
        stx count

        ldy tx_in               ; stuffed into the ring: each zero becomes the distance to the next
        lda #0
        sta tx_ring,y
        iny
        jsr new_code
        ldx #0
stuff:  lda reply,x
        beq zero
        sta tx_ring,y
        iny
        inc code
        jmp stuffed
zero:   jsr close_code
        jsr new_code
stuffed:
        inx
        cpx count
        bne stuff
        jsr close_code
        lda #0
        sta tx_ring,y
        iny
        sty tx_in
        jmp begin_sending

new_code:
        sty code_at
        lda #1
        sta code
        iny
        rts

close_code:
        sty scratch
        ldy code_at
        lda code
        sta tx_ring,y
        ldy scratch
        rts
