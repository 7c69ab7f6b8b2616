#include "uart.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

/* With double speed, rounded to the nearest: 117,647 baud at 115200, as every Mega has, its USB adapter too. */
#define DIVISOR ((F_CPU + 4ul * BAUD) / (8ul * BAUD) - 1ul)

/* Both are 256 bytes, so that places wrap by themselves: more than comes while a stop reads the posture (10 ms). */
static volatile uint8_t received[256];
static volatile uint8_t received_end;
static uint8_t received_begin;
static volatile uint8_t sent[256];
static volatile uint8_t sent_begin;
static volatile uint8_t sent_end;

void uart_start(void)
{
    UCSR0A = 1u << U2X0;
    UBRR0 = (uint16_t)DIVISOR;
    UCSR0C = (1u << UCSZ01) | (1u << UCSZ00);
    UCSR0B = (1u << RXCIE0) | (1u << RXEN0) | (1u << TXEN0);
}

ISR(USART0_RX_vect)
{
    received[received_end] = UDR0;
    ++received_end;
}

int16_t uart_next_byte(void)
{
    return received_begin == received_end ? -1 : received[received_begin++];
}

ISR(USART0_UDRE_vect)
{
    UDR0 = sent[sent_begin++];
    if (sent_begin == sent_end) {
        UCSR0B = (uint8_t)(UCSR0B & ~(1u << UDRIE0));
    }
}

bool uart_can_send(void)
{
    return (uint8_t)(sent_end + 1u) != sent_begin;
}

void uart_send(uint8_t byte)
{
    sent[sent_end] = byte;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        ++sent_end;
        UCSR0B = (uint8_t)(UCSR0B | (1u << UDRIE0));
    }
}
