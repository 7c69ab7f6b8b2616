/* How long ago certain moments were. Time is counted on at every call of the bridge. */
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

/* All moments are long ago. */
void moments_start(void);

/* Reads the board's clock: this is the present from now on. */
void moments_read_clock(void);

/* The moment is the present, or lies that many microseconds back. */
void moment_was(enum moment moment, uint16_t ago_us);

/* Microseconds from a moment to the present; LONG_AGO for any longer time. */
uint16_t us_since(enum moment moment);

#endif
