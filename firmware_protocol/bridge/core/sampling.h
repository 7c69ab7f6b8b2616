/* Sample: the oldest snapshot above a tick, at once or when its period has ended (PROTOCOL.md, section 4). */
#ifndef BRIDGE_SAMPLING_H
#define BRIDGE_SAMPLING_H

#include <stdint.h>

void sampling_start(void);

/* A host asks; a request that waits is forgotten. */
void sampling_request(uint16_t sequence, uint32_t after, uint8_t mask);

/* Answers the request that waits, if its moment has come. Only while no reply is being sent. */
void sampling_work(void);

/* A request that waits is answered from the board's new life. */
void sampling_board_was_reset(void);

#endif
