/* Parts that several replies share. */
#ifndef BRIDGE_REPLIES_H
#define BRIDGE_REPLIES_H

#include <stdint.h>

#include "framing.h"
#include "protocol.h"
#include "registers.h"

/* Begins the reply to a request. */
void reply_to(const struct frame *frame);

/* A reply without payload. */
void acknowledge(const struct frame *frame);

void refuse(uint16_t sequence, uint8_t opcode, enum refusal reason);

void reply_reading(const struct reading *reading);

#endif
