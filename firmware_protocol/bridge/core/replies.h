/* Parts that several replies share. */
#ifndef BRIDGE_REPLIES_H
#define BRIDGE_REPLIES_H

#include <stdint.h>

#include "protocol.h"
#include "registers.h"

void refuse(uint16_t sequence, uint8_t opcode, enum refusal reason);

void reply_reading(const struct reading *reading);

#endif
