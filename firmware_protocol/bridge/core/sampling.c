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

#define LONGEST_WAIT 25u /* periods */

static uint8_t waiting; /* periods for which the request may still wait; 0 where there is none */
static uint16_t sequence;
static uint32_t after;
static uint8_t mask;

void sampling_start(void)
{
    waiting = 0;
}

void sampling_board_was_reset(void)
{
    after = 0;
}

void sampling_request(uint16_t request_sequence, uint32_t after_tick, uint8_t joints)
{
    waiting = LONGEST_WAIT;
    sequence = request_sequence;
    after = after_tick > period_tick() ? ring_newest_tick() : after_tick;
    mask = joints;
    moment_was(SAMPLE_WAITS, 0);
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
            reply_reading(&snapshot->joints[joint]);
        }
    }
    reply_send();
}

void sampling_work(void)
{
    if (waiting == 0) {
        return;
    }
    uint32_t tick = after;
    const struct snapshot *snapshot = ring_oldest_after(&tick);
    const uint16_t waited_us = us_since(SAMPLE_WAITS);
    if (snapshot != NULL) {
        waiting = 0;
        answer(tick, snapshot);
    } else if (waited_us >= PERIOD_US) {
        moment_was(SAMPLE_WAITS, (uint16_t)(waited_us - PERIOD_US));
        if (--waiting == 0) {
            refuse(sequence, SAMPLE, NOTHING_NEW);
        }
    }
}
