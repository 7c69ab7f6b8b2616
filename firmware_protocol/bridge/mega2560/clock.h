/* Microseconds for the core: board_time_us() of core.h. */
#ifndef MEGA2560_CLOCK_H
#define MEGA2560_CLOCK_H

void clock_start(void);

#endif
