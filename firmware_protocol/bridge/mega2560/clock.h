/* Microseconds for the core (board_time_us() of core.h), and rest between two looks at what is to be done. */
#ifndef MEGA2560_CLOCK_H
#define MEGA2560_CLOCK_H

void clock_start(void);

/* Rests until a byte comes from the host, or for 100 microseconds at most. */
void clock_rest(void);

#endif
