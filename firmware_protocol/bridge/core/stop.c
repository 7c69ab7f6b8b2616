#include "stop.h"

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
static uint8_t readings;
static uint16_t newest[JOINTS];    /* ADC counts, of the newest reading */
static uint16_t to_freeze[JOINTS]; /* of each joint what two readings in a row agreed on last, else the newest */
static bool agreed[JOINTS];        /* two readings in a row have agreed on it */

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

/* Sets the set points to the posture `to_freeze`. If it is all zero, nothing is written: the board has no supply. */
static void freeze(void)
{
    if (!all_zero(to_freeze)) {
        for (uint8_t joint = 0; joint < JOINTS; ++joint) {
            write_set_point(joint, posture_of(to_freeze[joint]));
        }
        moments_read_clock();
        period_set_points_written();
    }
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
        for (uint8_t joint = 0; joint < JOINTS; ++joint) {
            to_freeze[joint] = position_of(&ring_newest()->joints[joint]);
        }
        freeze();
    } else {
        reading_posture = true;
        readings = 1;
        for (uint8_t joint = 0; joint < JOINTS; ++joint) {
            agreed[joint] = false;
        }
        moment_was(POSTURE_READ, 0);
        (void)read_positions(newest);
    }
}

/* Reads the positions again. True when every joint reads as before. */
static bool read_again(void)
{
    bool all_agree = true;
    moment_was(POSTURE_READ, 0);
    ++readings;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        const uint16_t counts = read_position(joint);
        const bool agrees = counts == newest[joint];
        if (agrees || !agreed[joint]) {
            to_freeze[joint] = counts;
        }
        newest[joint] = counts;
        agreed[joint] |= agrees;
        all_agree &= agrees;
    }
    return all_agree;
}

void stop_work(void)
{
    if (!reading_posture || us_since(POSTURE_READ) < READ_AGAIN_US || period_wants_memory()) {
        return;
    }
    if (read_again() || readings == MOST_READINGS) {
        reading_posture = false;
        freeze();
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
