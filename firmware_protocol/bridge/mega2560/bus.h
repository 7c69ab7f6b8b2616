/* The 1 MHz bus, with the Mega in the place of the BBC Micro. */
#ifndef MEGA2560_BUS_H
#define MEGA2560_BUS_H

/* Starts the clock 1MHzE and drives the bus, idle. */
void bus_start(void);

#endif
