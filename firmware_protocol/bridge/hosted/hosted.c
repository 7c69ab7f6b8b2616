/* The core as a shared library of a computer, for tests: its three functions are those that the caller hands over. */
#include "../core/core.h"
#include "hosted.h"

static uint8_t (*read_byte)(uint16_t address);
static void (*write_byte)(uint16_t address, uint8_t value);
static uint32_t (*time_us)(void);

uint8_t board_read_byte(uint16_t address)
{
    return read_byte(address);
}

void board_write_byte(uint16_t address, uint8_t value)
{
    write_byte(address, value);
}

uint32_t board_time_us(void)
{
    return time_us();
}

void hosted_start(uint8_t (*reader)(uint16_t), void (*writer)(uint16_t, uint8_t), uint32_t (*clock)(void),
                  int period_source, int frozen, uint32_t first_number)
{
    struct bridge_settings settings = {PERIOD_UNSEEN, false, false, 0};
    settings.period_source = (enum period_source)period_source;
    settings.frozen = frozen != 0;
    settings.first_number = first_number;
    read_byte = reader;
    write_byte = writer;
    time_us = clock;
    bridge_start(&settings);
}

int hosted_take(const uint8_t *bytes, int count)
{
    int taken = 0;
    while (taken < count && bridge_wants_byte()) {
        bridge_take_byte(bytes[taken++]);
    }
    return taken;
}

int hosted_give(uint8_t *bytes, int room)
{
    int given = 0;
    while (given < room) {
        const int16_t byte = bridge_next_byte();
        if (byte < 0) {
            break;
        }
        bytes[given++] = (uint8_t)byte;
    }
    return given;
}
