/* Numbers in a message, little-endian. */
#ifndef BRIDGE_NUMBERS_H
#define BRIDGE_NUMBERS_H

#include <stdint.h>

static inline uint16_t u16_at(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | ((uint16_t)bytes[1] << 8));
}

static inline uint32_t u32_at(const uint8_t *bytes)
{
    return u16_at(bytes) | ((uint32_t)u16_at(bytes + 2) << 16);
}

#endif
