#include "stop.h"

#include <string.h>

#include "framing.h"
#include "period.h"
#include "registers.h"
#include "ring.h"
#include "session.h"

/* Between two readings of the positions: longer than the controller takes to store a period's results. */
#define READ_AGAIN_US 2000ul

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

/* Positions of the newest complete period become the set points. */
static void hold_newest_posture(void)
{
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        struct reading reading;
        unpack(ring_newest()->joints[joint], &reading);
        write_set_point(joint, posture_of(reading.position));
    }
}

/* The positions read twice become the set points; all zero, they are of a board without supply: nothing to write. */
static void hold_posture_read(void)
{
    uint16_t counts[JOINTS];
    uint16_t any = 0;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        counts[joint] = position_in(positions, joint);
        any |= counts[joint];
    }
    for (uint8_t joint = 0; joint < JOINTS && any != 0; ++joint) {
        write_set_point(joint, posture_of(counts[joint]));
    }
}

static void end_freezing(uint32_t now_us)
{
    reading_posture = false;
    frozen_tick = period_tick(now_us);
    period_set_points_written(now_us);
    answer();
}

void stop_request(uint16_t request_sequence, uint32_t now_us)
{
    number = fresh_number();
    sequence = request_sequence;
    if (frozen) {
        answer();
        return;
    }
    frozen = true;
    if (period_is_followed() && ring_newest() != 0) {
        hold_newest_posture();
        end_freezing(now_us);
    } else {
        reading_posture = true;
        read_us = now_us;
        read_positions(positions);
    }
}

void stop_work(uint32_t now_us)
{
    if (!reading_posture || now_us - read_us < READ_AGAIN_US) {
        return;
    }
    uint8_t again[POSITION_BYTES];
    read_us = now_us;
    read_positions(again);
    if (memcmp(again, positions, POSITION_BYTES) == 0) {
        hold_posture_read();
        end_freezing(now_us);
    } else {
        memcpy(positions, again, POSITION_BYTES);
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
