; The serial line: the interrupt moves bytes between the 6850 and two rings of 256 bytes.

.include "machine.inc"
.importzp rx_in, rx_out, tx_in, tx_out, tx_on, irq_status
.import rx_ring, tx_ring

.export line_interrupt, begin_sending

.code

; The operating system has put A into FC. Takes a byte that has come; gives the next one when the last is on its way.
; A byte that finds the ring full is dropped: its frame is then damaged, and the host asks again.
line_interrupt:
        txa
        pha
        lda ACIA_STATUS
        sta irq_status
        and #1
        beq none_received
        lda ACIA_DATA
        ldx rx_in
        sta rx_ring,x
        inx
        cpx rx_out
        beq send
        stx rx_in
        jmp send
none_received:
        lda irq_status
        and #4                  ; a lost carrier, which RS423 does not have: reading ends its interrupt
        beq send
        lda ACIA_DATA
send:   lda irq_status
        and #2
        beq leave
        lda tx_on
        beq leave
        ldx tx_out
        cpx tx_in
        beq none_left
        lda tx_ring,x
        sta ACIA_DATA
        inc tx_out
        jmp leave
none_left:
        lda #0
        sta tx_on
        lda #ACIA_RECEIVE
        sta ACIA_CONTROL
leave:  pla
        tax
        lda IRQ_A
        rti

; Something has been put into the ring: the 6850 asks for it by its interrupt.
begin_sending:
        sei
        lda #1
        sta tx_on
        lda #ACIA_BOTH
        sta ACIA_CONTROL
        cli
        rts
