#include "ring.h"

#include <stddef.h>

#if (RING_DEPTH & (RING_DEPTH - 1u)) != 0 || RING_DEPTH > 64u
#error "RING_DEPTH has to be 8, 16, 32 or 64: the last bits of a tick tell its place"
#endif

/* Status of a ring entry whose period has no snapshot. No flag has this value. */
#define MISSING 0x80u

static struct snapshot kept[RING_DEPTH];
static uint8_t count; /* of entries in use, up to that of the newest tick */
static uint32_t newest_tick;

void ring_clear(void)
{
    count = 0;
    newest_tick = 0;
}

/* The entry of the tick that is `age` periods older than the newest. */
static struct snapshot *place_of_age(uint8_t age)
{
    return &kept[(uint8_t)((uint8_t)newest_tick - age) % RING_DEPTH];
}

void ring_add(uint32_t tick, const struct snapshot *snapshot)
{
    const uint32_t ahead = tick - newest_tick;
    newest_tick = tick;
    if (count == 0 || ahead == 0 || ahead > RING_DEPTH) {
        count = 1;
    } else {
        for (uint8_t age = (uint8_t)(ahead - 1u); age > 0; --age) {
            place_of_age(age)->status = MISSING;
        }
        const uint8_t in_use = (uint8_t)(count + ahead);
        count = in_use < RING_DEPTH ? in_use : RING_DEPTH;
    }
    *place_of_age(0) = *snapshot;
}

uint32_t ring_newest_tick(void)
{
    return newest_tick;
}

const struct snapshot *ring_newest(void)
{
    return count == 0 ? NULL : place_of_age(0);
}

const struct snapshot *ring_oldest_after(uint32_t *after)
{
    if (count == 0 || *after >= newest_tick) {
        return NULL;
    }
    const uint32_t later = newest_tick - *after;
    uint8_t age = (uint8_t)((later < count ? later : count) - 1u);
    while (place_of_age(age)->status == MISSING) { /* the newest never is */
        --age;
    }
    *after = newest_tick - age;
    return place_of_age(age);
}
