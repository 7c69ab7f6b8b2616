/* Sessions, the numbers of commands, and numbers that are given only once (PROTOCOL.md, section 3). */
#ifndef BRIDGE_SESSION_H
#define BRIDGE_SESSION_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

void session_start(uint32_t first_number);

/* A number that no session and no stop has had; never 0. */
uint32_t fresh_number(void);
uint32_t newest_number(void);

/* Begins a session, or finds that the greeting repeats that of the present one; returns the session's number. */
uint32_t session_greet(uint32_t nonce);

void session_end(void);
bool session_is_open(void);

/* The board was reset: the session ends, and RESTARTED is set. */
void session_board_was_reset(void);

/* Whether to carry out a command with this stamp: NOT_REFUSED, BAD_SESSION or STALE. */
enum refusal session_judge(const uint8_t *stamp);

/* Whether the board was reset, or the bridge has started, since the last greeting that began a session. */
bool session_restarted(void);

/* 1 when the bridge starts, and one more for each reset of the board that it sees. */
uint16_t session_boots(void);

#endif
