#include "sampling.h"

#include <stdbool.h>
#include <stddef.h>

#include "framing.h"
#include "moments.h"
#include "numbers.h"
#include "period.h"
#include "replies.h"
#include "ring.h"
#include "session.h"

#define LONGEST_WAIT_US (25ul * PERIOD_US)

static bool waiting;
static uint16_t sequence;
static uint32_t after;
static uint8_t mask;
static uint32_t since_us;

void sampling_start(void)
{
    waiting = false;
}

void sampling_board_was_reset(void)
{
    after = 0;
}

void sampling_request(uint16_t request_sequence, uint32_t after_tick, uint8_t joints)
{
    waiting = true;
    sequence = request_sequence;
    after = after_tick > period_tick() ? ring_newest_tick() : after_tick;
    mask = joints;
    since_us = present_us();
    sampling_work();
}

static void answer(uint32_t tick, const struct snapshot *snapshot)
{
    reply_begin(sequence, SAMPLE | REPLY_BIT);
    reply_u32(tick);
    reply_u8((uint8_t)(snapshot->status | (session_restarted() ? STATUS_RESTARTED : 0)));
    reply_u8(mask);
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        if (has_joint(mask, joint)) {
            struct reading reading;
            unpack(snapshot->joints[joint], &reading);
            reply_reading(&reading);
        }
    }
    reply_send();
}

void sampling_work(void)
{
    if (!waiting) {
        return;
    }
    uint32_t tick = after;
    const struct snapshot *snapshot = ring_oldest_after(&tick);
    if (snapshot != NULL) {
        waiting = false;
        answer(tick, snapshot);
    } else if (present_us() - since_us >= LONGEST_WAIT_US) {
        waiting = false;
        refuse(sequence, SAMPLE, NOTHING_NEW);
    }
}
