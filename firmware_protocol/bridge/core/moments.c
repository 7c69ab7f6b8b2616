#include "moments.h"

#include "core.h"

static uint32_t now_us;

void moments_read_clock(void)
{
    now_us = board_time_us();
}

uint32_t present_us(void)
{
    return now_us;
}

uint16_t us_since(const uint32_t *moment_us)
{
    const uint32_t since_us = now_us - *moment_us;
    return since_us < UINT16_MAX ? (uint16_t)since_us : UINT16_MAX;
}
