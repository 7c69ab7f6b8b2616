#include "stop.h"

#include <stddef.h>
#include <string.h>

#include "framing.h"
#include "moments.h"
#include "period.h"
#include "registers.h"
#include "ring.h"
#include "session.h"

/* Between two readings of the positions: longer than the controller takes to store a period's results. */
#define READ_AGAIN_US 2000u

static bool frozen;
static bool reading_posture;
static uint32_t number;
static uint32_t frozen_tick;
static uint16_t sequence;
static uint32_t read_us;
static uint8_t positions[POSITION_BYTES];

void stop_start(bool begin_frozen)
{
    frozen = begin_frozen;
    reading_posture = false;
    frozen_tick = 0;
    number = frozen ? fresh_number() : 0;
}

static void answer(void)
{
    reply_begin(sequence, STOP | REPLY_BIT);
    reply_u32(frozen_tick);
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        reply_u16(read_set_point(joint));
    }
    reply_send();
}

/* Set points become this posture. */
static void freeze(const uint16_t counts[JOINTS])
{
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        write_set_point(joint, posture_of(counts[joint]));
    }
    moments_read_clock();
    period_set_points_written();
}

static void freeze_newest_posture(void)
{
    uint16_t counts[JOINTS];
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        struct reading reading;
        unpack(ring_newest()->joints[joint], &reading);
        counts[joint] = reading.position;
    }
    freeze(counts);
}

/* Of positions that are all zero nothing is written: the board has no supply. */
static void freeze_posture_read(void)
{
    uint16_t counts[JOINTS];
    uint16_t any = 0;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        counts[joint] = position_in(positions, joint);
        any |= counts[joint];
    }
    if (any != 0) {
        freeze(counts);
    }
}

static void answer_frozen(void)
{
    frozen_tick = period_tick();
    answer();
}

void stop_request(uint16_t request_sequence)
{
    number = fresh_number();
    sequence = request_sequence;
    if (frozen) {
        answer();
        return;
    }
    frozen = true;
    if (period_is_followed() && ring_newest() != NULL) {
        freeze_newest_posture();
        answer_frozen();
    } else {
        reading_posture = true;
        read_us = present_us();
        read_positions(positions);
    }
}

void stop_work(void)
{
    if (!reading_posture || us_since(&read_us) < READ_AGAIN_US) {
        return;
    }
    uint8_t again[POSITION_BYTES];
    read_us = present_us();
    read_positions(again);
    const bool agree = memcmp(again, positions, POSITION_BYTES) == 0;
    memcpy(positions, again, POSITION_BYTES);
    if (agree) {
        reading_posture = false;
        freeze_posture_read();
        answer_frozen();
    }
}

bool stop_is_reading(void)
{
    return reading_posture;
}

bool stop_release(uint32_t named)
{
    if (named != number) {
        return false;
    }
    frozen = false;
    return true;
}

bool stop_is_in_force(void)
{
    return frozen;
}

uint32_t stop_number(void)
{
    return number;
}
