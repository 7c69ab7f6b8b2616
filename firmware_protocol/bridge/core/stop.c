#include "stop.h"

#include <string.h>

#include "framing.h"
#include "moments.h"
#include "numbers.h"
#include "period.h"
#include "registers.h"
#include "ring.h"
#include "session.h"

/* Between two readings of the positions: longer than the controller takes to store a period's results. */
#define READ_AGAIN_US 2000u
/* In a sound memory two of so many readings in a row agree, since results are stored at most once meanwhile. */
#define MOST_READINGS 4u

static bool frozen;
static bool reading_posture;
static uint32_t number;
static uint32_t frozen_tick;
static uint16_t sequence;
static uint32_t read_us;
static uint8_t readings;
static uint8_t positions[POSITION_BYTES]; /* the newest reading */
static uint16_t counts_read[JOINTS];      /* of each joint what two readings in a row agreed on last, else the newest */
static uint8_t joints_agreed;             /* a mask: two readings in a row have agreed on them */

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
    uint16_t any = 0;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        any |= counts_read[joint];
    }
    if (any != 0) {
        freeze(counts_read);
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
    if (period_newest_is_current()) {
        freeze_newest_posture();
        answer_frozen();
    } else {
        reading_posture = true;
        readings = 1;
        joints_agreed = 0;
        read_us = present_us();
        read_positions(positions);
    }
}

/* Reads the positions again. True when every joint reads as before. */
static bool read_again(void)
{
    uint8_t again[POSITION_BYTES];
    bool all_agree = true;
    read_us = present_us();
    read_positions(again);
    ++readings;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        const uint16_t counts = position_in(again, joint);
        if (counts == position_in(positions, joint)) {
            joints_agreed = (uint8_t)(joints_agreed | (1u << joint));
            counts_read[joint] = counts;
        } else {
            all_agree = false;
            if (!has_joint(joints_agreed, joint)) {
                counts_read[joint] = counts;
            }
        }
    }
    memcpy(positions, again, POSITION_BYTES);
    return all_agree;
}

void stop_work(void)
{
    if (!reading_posture || us_since(&read_us) < READ_AGAIN_US || period_wants_memory()) {
        return;
    }
    if (read_again() || readings == MOST_READINGS) {
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
