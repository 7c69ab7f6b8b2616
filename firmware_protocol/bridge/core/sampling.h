/* Sample: the oldest snapshot above a tick, at once or when its period has ended (PROTOCOL.md, section 4). */
#ifndef BRIDGE_SAMPLING_H
#define BRIDGE_SAMPLING_H

#include <stdint.h>

void sampling_start(void);

/* Begins a host's request; a waiting one is dropped. */
void sampling_request(uint16_t sequence, uint32_t after, uint8_t mask);

/* Answers the waiting request if it can be answered now. Only while no reply is being sent. */
void sampling_work(void);

/* After a reset of the board: the waiting request gets the first snapshot after it. */
void sampling_board_was_reset(void);

#endif
