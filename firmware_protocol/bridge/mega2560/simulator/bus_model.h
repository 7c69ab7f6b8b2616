/* The 1 MHz bus and the shared RAM at its other end, as the Mega's pins see them. */
#ifndef MEGA2560_BUS_MODEL_H
#define MEGA2560_BUS_MODEL_H

#include <simavr/sim_avr.h>

#include "simulator.h"

void bus_model_start(avr_t *processor, uint8_t (*read_byte)(uint16_t address, uint64_t clock),
                     void (*write_byte)(uint16_t address, uint8_t value, uint64_t clock));
const struct bus_report *bus_model_report(void);

#endif
