/* The controller's periods: when one ends, what it left in the memory, and when the controller wants the memory. */
#ifndef BRIDGE_PERIOD_H
#define BRIDGE_PERIOD_H

#include <stdbool.h>
#include <stdint.h>

#include "core.h"

void period_start(enum period_source source);

/* Looks at the memory where that is due. */
void period_work(void);

/* The controller has stored a period's results. */
void period_ended(void);

/* Whether the newest snapshot is of the latest complete period, or of the one before while that is being read. */
bool period_newest_is_current(void);

/* Periods begun since the board's last reset; always 0 where periods are not seen. */
uint32_t period_tick(void);

/* Whether the controller is about to fetch its set points: the bridge then leaves the memory alone. */
bool period_wants_memory(void);

/* Set points have been written: the next period that begins is expected to take them. */
void period_set_points_written(void);

/* Periods in which the controller did not take the set points that were in the memory. */
uint32_t period_missed_set_points(void);

#endif
