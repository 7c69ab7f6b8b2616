/* The host's line: UART 0, which is also the board's USB. 8 data bits, no parity, 1 stop bit. */
#ifndef MEGA2560_UART_H
#define MEGA2560_UART_H

#include <stdbool.h>
#include <stdint.h>

void uart_start(void);

/* The oldest byte that has come, or -1. */
int16_t uart_next_byte(void);

/* Whether a byte more can be kept for sending. */
bool uart_can_send(void);
void uart_send(uint8_t byte);

#endif
