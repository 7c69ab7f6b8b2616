/* Stop and release (PROTOCOL.md, section 6). */
#ifndef BRIDGE_STOP_H
#define BRIDGE_STOP_H

#include <stdbool.h>
#include <stdint.h>

void stop_start(bool frozen);

/* Set points are held from now on. The reply follows when the posture is known, at once where periods are followed. */
void stop_request(uint16_t sequence);

/* Continues a stop whose posture is still being read. Only while no reply is being sent. */
void stop_work(void);

/* Whether a stop's reply is still owed. Other requests wait meanwhile, 10 ms at most. */
bool stop_is_reading(void);

/* Ends the freeze if `number` is that of the newest stop; false if it is not. */
bool stop_release(uint32_t number);

bool stop_is_in_force(void);

/* Number of the newest stop, 0 if there was none since the bridge started. */
uint32_t stop_number(void);

#endif
