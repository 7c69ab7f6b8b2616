/* Functions of the shared library for programs of this computer, besides core.h. */
#ifndef BRIDGE_HOSTED_H
#define BRIDGE_HOSTED_H

#include <stdint.h>

void hosted_start(uint8_t (*reader)(uint16_t), void (*writer)(uint16_t, uint8_t), uint32_t (*clock)(void),
                  int period_source, int frozen, uint32_t first_number);

/* Passes bytes from the host while the bridge accepts them; returns how many. */
int hosted_take(const uint8_t *bytes, int count);

/* Bytes for the host, as many as there are and fit; returns how many. */
int hosted_give(uint8_t *bytes, int room);

#endif
