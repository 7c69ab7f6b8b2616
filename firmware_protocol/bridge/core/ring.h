/* The snapshots of the controller's last periods. */
#ifndef BRIDGE_RING_H
#define BRIDGE_RING_H

#include <stdbool.h>
#include <stdint.h>

#include "registers.h"

struct snapshot {
    uint8_t status; /* flags of this period: FROZEN, SET_POINT_MISSED */
    struct reading joints[JOINTS];
};

void ring_clear(void);

/* Adds the snapshot of a period. Skipped periods since the newest one get entries without a snapshot. */
void ring_add(uint32_t tick, const struct snapshot *snapshot);

/* The newest tick, 0 when the ring is empty. */
uint32_t ring_newest_tick(void);
const struct snapshot *ring_newest(void);

/* The oldest snapshot with a tick above `after`, which becomes its tick; NULL when there is none. */
const struct snapshot *ring_oldest_after(uint32_t *after);

#endif
