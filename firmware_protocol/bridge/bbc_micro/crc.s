; CRC-16, polynomial 1021, most significant bit first: one step per byte, by a table made at the start.

.importzp crc_low, crc_high
.import crc_table_low, crc_table_high

.export make_crc_table, crc_begin, crc_add

.code

make_crc_table:
        ldx #0
each:   stx crc_high
        lda #0
        sta crc_low
        ldy #8
bit_:   asl crc_low
        rol crc_high
        bcc even
        lda crc_low
        eor #$21
        sta crc_low
        lda crc_high
        eor #$10
        sta crc_high
even:   dey
        bne bit_
        lda crc_low
        sta crc_table_low,x
        lda crc_high
        sta crc_table_high,x
        inx
        bne each
        rts

crc_begin:
        lda #$FF
        sta crc_low
        sta crc_high
        rts

; Adds the byte in A. Keeps X; Y is lost.
crc_add:
        eor crc_high
        tay
        lda crc_low
        eor crc_table_high,y
        sta crc_high
        lda crc_table_low,y
        sta crc_low
        rts
