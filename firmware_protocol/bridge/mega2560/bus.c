/* The 1 MHz bus, with the Mega in the place of the BBC Micro: it drives clock, address, R/W and page select.
 *
 * pins        signal
 * PA0-PA7     A0-A7
 * PC0-PC7     D0-D7
 * PG0         NPGFC, low while the page FC00-FCFF is addressed
 * PG1         R/W, high to read
 * PG5 (OC0B)  1MHzE, from timer 0: never stops
 *
 * Timer 0 counts 0 to 15 at 16 MHz; 1MHzE is high while it counts 0 to 7. In clocks of 62.5 ns from the rise of 1MHzE,
 * counted on through a cycle that begins in its low half:
 *
 *    8      1MHzE falls
 *   10      NPGFC falls, address, R/W and data to be written being there       published: 250 ns before 16, here 375 ns
 *   16      1MHzE rises
 *   20.8    data to be read are there                                          published: 200 ns before 24
 *   22-24   they are read
 *   24      1MHzE falls: the cycle ends
 *   26      NPGFC rises                                                        published: 30 ns after 24, here 125 ns
 *   27      R/W, address and data may change                                   published: 50 ns after 24, here 188 ns
 *
 * The published times are those of Acorn's Application Note 003, "1MHz Bus" (docs/hardware.md). */
#include "bus.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "../core/core.h"

#define CLOCKS_PER_CYCLE 16u
#define NPGFC (1u << PG0)
#define READ_NOT_WRITE (1u << PG1)
#define CLOCK_1MHZE (1u << PG5)
/* Other pins of the port keep their pull-ups. */
#define PORT_G_REST ((1u << PG2) | (1u << PG3) | (1u << PG4))
#define BUS_IDLE (PORT_G_REST | READ_NOT_WRITE | NPGFC)

void bus_start(void)
{
    PORTA = 0;
    DDRA = 0xFF;
    PORTC = 0xFF; /* pull-ups hold the data lines while nobody drives them */
    DDRC = 0;
    PORTG = BUS_IDLE;
    DDRG = NPGFC | READ_NOT_WRITE | CLOCK_1MHZE;
    OCR0A = CLOCKS_PER_CYCLE - 1u;
    OCR0B = CLOCKS_PER_CYCLE / 2u - 1u;
    TCCR0A = (1u << COM0B1) | (1u << WGM01) | (1u << WGM00); /* OC0B: high from 0, low after OCR0B */
    TCCR0B = (1u << WGM02) | (1u << CS00);                   /* 0 to OCR0A, one count a clock */
}

/* One cycle of the bus with address, R/W and data as they stand; returns what the data lines carried at its end.
 *
 * The code may begin in any clock of the timer, and has to write NPGFC in its clock 9. If the timer reads t, 8 clocks
 * go by up to the jump, and (t + 14) mod 16 says where it enters the 15 no-operations: so many are left out, and what is
 * left always ends in clock 8. The 14 clocks after NPGFC are counted from the table above. */
static uint8_t bus_cycle(uint8_t selected, uint8_t idle)
{
    uint8_t data;
    __asm__ volatile(
        "in   r30, %[timer]          \n\t"
        "subi r30, -14               \n\t"
        "andi r30, 15                \n\t"
        "ldi  r31, 0                 \n\t"
        "subi r30, lo8(-(pm(1f)))    \n\t"
        "sbci r31, hi8(-(pm(1f)))    \n\t"
        "ijmp                        \n"
        "1:                          \n\t"
        ".rept 15                    \n\t"
        "nop                         \n\t"
        ".endr                       \n\t"
        "out  %[port], %[selected]   \n\t" /* in clock 9: NPGFC falls at 10 */
        ".rept 14                    \n\t"
        "nop                         \n\t"
        ".endr                       \n\t"
        "in   %[data], %[pins]       \n\t" /* in clock 24: the pins as they were at 22.5 to 23.5 */
        "out  %[port], %[idle]       \n\t" /* in clock 25: NPGFC rises at 26 */
        : [data] "=r"(data)
        : [timer] "I"(_SFR_IO_ADDR(TCNT0)), [port] "I"(_SFR_IO_ADDR(PORTG)), [pins] "I"(_SFR_IO_ADDR(PINC)),
          [selected] "r"(selected), [idle] "r"(idle)
        : "r30", "r31");
    return data;
}

uint8_t board_read_byte(uint16_t address)
{
    uint8_t data = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        PORTA = (uint8_t)address;
        data = bus_cycle(PORT_G_REST | READ_NOT_WRITE, BUS_IDLE);
    }
    return data;
}

void board_write_byte(uint16_t address, uint8_t value)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        PORTA = (uint8_t)address;
        PORTG = PORT_G_REST | NPGFC;
        PORTC = value;
        DDRC = 0xFF;
        (void)bus_cycle(PORT_G_REST, PORT_G_REST | NPGFC);
        DDRC = 0;
        PORTC = 0xFF;
        PORTG = BUS_IDLE;
    }
}
