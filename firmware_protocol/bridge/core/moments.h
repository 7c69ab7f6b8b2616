/* Times since certain events. They are updated at every call of the bridge. */
#ifndef BRIDGE_MOMENTS_H
#define BRIDGE_MOMENTS_H

#include <stdint.h>

enum moment {
    RESULTS_STORED,  /* the controller began to store the newest results */
    POSITIONS_SEEN,  /* the positions were read last */
    SNAPSHOT_KEPT,   /* the newest snapshot was put into the ring */
    POSTURE_READ,    /* a stop read the positions last */
    SAMPLE_WAITS,    /* a Sample began to wait, or the period began in which it goes on waiting */
    MOMENTS
};

#define LONG_AGO UINT16_MAX

/* Sets all times to LONG_AGO. */
void moments_start(void);

/* Reads the board's clock and updates all times. */
void moments_read_clock(void);

/* Sets a moment to now, or to that many microseconds ago. */
void moment_was(enum moment moment, uint16_t ago_us);

/* Microseconds since a moment; at most LONG_AGO. */
uint16_t us_since(enum moment moment);

#endif
