#include "moments.h"

#include "core.h"

static uint32_t present_us;
static uint16_t ages_us[MOMENTS];

void moments_start(void)
{
    present_us = board_time_us();
    for (uint8_t moment = 0; moment < MOMENTS; ++moment) {
        ages_us[moment] = LONG_AGO;
    }
}

void moments_read_clock(void)
{
    const uint32_t now_us = board_time_us();
    const uint16_t passed_us = now_us - present_us < LONG_AGO ? (uint16_t)(now_us - present_us) : LONG_AGO;
    present_us = now_us;
    for (uint8_t moment = 0; moment < MOMENTS; ++moment) {
        const uint16_t age_us = ages_us[moment];
        ages_us[moment] = passed_us < LONG_AGO - age_us ? (uint16_t)(age_us + passed_us) : LONG_AGO;
    }
}

void moment_was(enum moment moment, uint16_t ago_us)
{
    ages_us[moment] = ago_us;
}

uint16_t us_since(enum moment moment)
{
    return ages_us[moment];
}
