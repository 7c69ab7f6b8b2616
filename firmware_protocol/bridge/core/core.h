/* The bridge's core, between the host's line and the memory that the motor controller shares with it.
 *
 * This is the only header that a board includes. The board supplies three functions, hands over bytes of the line, and
 * calls bridge_work() as often as it can. There is no heap, no floating point, no operating system, and one bridge.
 */
#ifndef BRIDGE_CORE_H
#define BRIDGE_CORE_H

#include <stdbool.h>
#include <stdint.h>

/* ---- what the board supplies */

/* One byte of the shared memory at an address of the memory map (FC00 to FC7F in the one that ships). */
uint8_t board_read_byte(uint16_t address);
void board_write_byte(uint16_t address, uint8_t value);

/* Time in microseconds. It begins anywhere and wraps after 2^32 (71 minutes). */
uint32_t board_time_us(void);

/* ---- given by the board once */

/* How the bridge learns that the controller has ended a period. */
enum period_source {
    PERIOD_UNSEEN,  /* it does not: no SAMPLE; the host reads every block twice */
    PERIOD_WATCHED, /* by watching the positions change in the memory: needs no wire but the bus */
    PERIOD_TOLD     /* by calls of bridge_period_ended(), for a board that has a signal for it */
};

struct bridge_settings {
    enum period_source period_source;
    bool simulated;        /* there is no arm: the capability SIMULATED */
    bool frozen;           /* begin with set points held, as after a stop */
    uint32_t first_number; /* numbers of sessions and stops begin above it; PROTOCOL.md, section 3, "Fresh numbers" */
};

/* Starts or restarts the bridge. */
void bridge_start(const struct bridge_settings *settings);

/* ---- what the board does again and again */

/* Does all work that is due. Call it as often as possible, at least every 250 microseconds. */
void bridge_work(void);

/* Whether the bridge can accept a byte from the host now. While it cannot, the board stores the
 * bytes: as many as come in 15 ms. */
bool bridge_wants_byte(void);

/* Passes one byte from the host. A byte that the bridge cannot accept is lost. */
void bridge_take_byte(uint8_t byte);

/* The next byte for the host, or -1 when there is none. No byte of the host's is wanted until all have been fetched. So
 * the board has a buffer of at least 57 bytes, a largest frame, from which it sends; otherwise a stop might wait for as
 * long as the line takes for the reply before it. */
int16_t bridge_next_byte(void);

/* ---- events reported by the board */

/* The connection has ended, if the board can detect that: the session ends too. */
void bridge_hang_up(void);

/* The controller has stored the results of a period (PERIOD_TOLD only). */
void bridge_period_ended(void);

/* ---- stored by the board in non-volatile memory, if it has one */

/* Whether set points are held: pass it to bridge_start() after a loss of power. */
bool bridge_is_frozen(void);

/* The newest number that was given to a session or a stop. */
uint32_t bridge_newest_number(void);

#endif
