; Takes over the machine, then runs the main loop for ever. BREAK ends it.

.include "machine.inc"
.include "protocol.inc"
.importzp rx_in, rx_out, tx_in, tx_out, tx_on, received, too_long, following, tick, ring_count, sampling
.importzp session, newest, stop, seeded, boots, restarted, frozen, missed, written_tick, powered, has_looked, unchanged
.importzp read_once, frozen_tick
.import make_crc_table, line_interrupt, take_bytes, period_work, sample_work, begin_frozen

.export start, main_loop

.ifndef ULA_RATE
ULA_RATE = ULA_19200
.endif

.code

start:
        sei
        ldx #0
        lda #0
clear:  sta $00,x               ; every variable is 0
        inx
        cpx #$90
        bne clear
        cld

        lda #$7F                ; no interrupts of keyboard, clock, printer
        sta SYSTEM_VIA_ENABLE
        sta USER_VIA_ENABLE
        lda #$40                ; timer 1 of the user VIA runs for ever, in microseconds
        sta USER_VIA_CONTROL
        lda #$FF
        sta USER_VIA_T1_LOW
        sta USER_VIA_T1_HIGH

        jsr make_crc_table
        inc boots
        lda #FLAG_RESTARTED
        sta restarted
        inc powered
        jsr begin_frozen

        lda #<line_interrupt
        sta IRQ1V
        lda #>line_interrupt
        sta IRQ1V+1
        lda #ULA_RATE
        sta SERIAL_ULA
        lda #ACIA_RESET
        sta ACIA_CONTROL
        lda #ACIA_RECEIVE
        sta ACIA_CONTROL

        ldx #0
say:    lda banner,x
        beq said
        jsr OSWRCH
        inx
        bne say
said:   cli

main_loop:
        jsr take_bytes
        jsr period_work
        jsr sample_work
        jmp main_loop

.rodata

banner: .byte 22, 7             ; mode 7: its screen leaves 3000 to 7BFF free
        .byte "MA2000 bridge, protocol 2, "
.if ULA_RATE = ULA_9600
        .byte "9600 baud"
.else
        .byte "19200 baud"
.endif
        .byte 13, 10, "Set points are frozen until a release.", 13, 10, "BREAK ends it.", 13, 10, 0
