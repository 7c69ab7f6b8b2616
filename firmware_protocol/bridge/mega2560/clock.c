/* Timer 1 counts half microseconds; its overflows, every 32.768 ms, are counted by an interrupt. Timer 2 interrupts
 * every 100 microseconds, only to wake the processor. */
#include "clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "../core/core.h"

#define US_PER_OVERFLOW 32768ul
#define REST_US 100u

static volatile uint32_t overflowed_us;

void clock_start(void)
{
    TCCR1A = 0;
    TCCR1B = 1u << CS11; /* 16 MHz / 8 */
    TIMSK1 = 1u << TOIE1;
    OCR2A = REST_US * 2u - 1u; /* 16 MHz / 8 */
    TCCR2A = 1u << WGM21;
    TCCR2B = 1u << CS21;
    TIMSK2 = 1u << OCIE2A;
    SMCR = 1u << SE; /* idle: timers and UART go on */
}

ISR(TIMER1_OVF_vect)
{
    overflowed_us += US_PER_OVERFLOW;
}

ISR(TIMER2_COMPA_vect)
{
}

void clock_rest(void)
{
    __asm__ volatile("sleep");
}

uint32_t board_time_us(void)
{
    uint32_t us = 0;
    uint16_t half_us = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        half_us = TCNT1;
        us = overflowed_us;
        if ((TIFR1 & (1u << TOV1)) != 0 && half_us < 0x8000u) {
            us += US_PER_OVERFLOW; /* it has overflowed, and the interrupt is still to come */
        }
    }
    return us + (half_us >> 1);
}
