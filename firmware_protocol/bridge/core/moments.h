/* Time, read once at every call of the bridge, and moments that lie at most some minutes back. */
#ifndef BRIDGE_MOMENTS_H
#define BRIDGE_MOMENTS_H

#include <stdint.h>

/* Reads the board's clock: this is the present from now on. */
void moments_read_clock(void);

/* The present. */
uint32_t present_us(void);

/* Microseconds from a moment to the present; 65535 for any longer time. */
uint16_t us_since(const uint32_t *moment_us);

#endif
