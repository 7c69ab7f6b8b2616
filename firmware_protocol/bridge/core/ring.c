#include "ring.h"

#include <stddef.h>

/* The status of a place whose period has no snapshot. No flag has this value. */
#define MISSING 0x80u

static struct snapshot kept[RING_DEPTH];
static uint8_t count;
static uint8_t next; /* where the next snapshot goes */
static uint32_t newest_tick;

void pack(const struct reading *reading, uint8_t packed[PACKED_BYTES])
{
    const uint16_t error = (uint16_t)reading->error;
    packed[0] = (uint8_t)reading->set_point;
    packed[1] = (uint8_t)((reading->set_point >> 8) | ((reading->position >> 8) << 4));
    packed[2] = (uint8_t)reading->position;
    packed[3] = (uint8_t)error;
    packed[4] = (uint8_t)(error >> 8);
    packed[5] = (uint8_t)reading->power;
}

void unpack(const uint8_t packed[PACKED_BYTES], struct reading *reading)
{
    reading->set_point = (uint16_t)(packed[0] | ((packed[1] & 0x03u) << 8));
    reading->position = (uint16_t)(packed[2] | ((packed[1] >> 4) << 8));
    reading->error = (int16_t)(uint16_t)(packed[3] | ((uint16_t)packed[4] << 8));
    reading->power = (int8_t)packed[5];
}

void ring_clear(void)
{
    count = 0;
    next = 0;
    newest_tick = 0;
}

/* The next place becomes the newest. */
static void take_place(void)
{
    next = (uint8_t)((next + 1u) % RING_DEPTH);
    if (count < RING_DEPTH) {
        ++count;
    }
}

void ring_add(uint32_t tick, const struct snapshot *snapshot)
{
    if (tick <= newest_tick || tick - newest_tick > RING_DEPTH) {
        ring_clear();
    } else if (count > 0) {
        while (++newest_tick != tick) {
            kept[next].status = MISSING;
            take_place();
        }
    }
    newest_tick = tick;
    kept[next] = *snapshot;
    take_place();
}

uint32_t ring_newest_tick(void)
{
    return newest_tick;
}

/* The snapshot that is `age` periods older than the newest one. */
static const struct snapshot *snapshot_of_age(uint8_t age)
{
    return &kept[(uint8_t)(next + RING_DEPTH - 1u - age) % RING_DEPTH];
}

const struct snapshot *ring_newest(void)
{
    return count == 0 ? NULL : snapshot_of_age(0);
}

const struct snapshot *ring_oldest_after(uint32_t *after)
{
    if (count == 0 || *after >= newest_tick) {
        return NULL;
    }
    const uint32_t later = newest_tick - *after;
    uint8_t age = (uint8_t)((later < count ? later : count) - 1u);
    while (snapshot_of_age(age)->status == MISSING) { /* the newest never is */
        --age;
    }
    *after = newest_tick - age;
    return snapshot_of_age(age);
}
