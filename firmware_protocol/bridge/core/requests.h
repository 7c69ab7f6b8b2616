/* Whether a request is valid by itself, in any state of the bridge (PROTOCOL.md, section 2). */
#ifndef BRIDGE_REQUESTS_H
#define BRIDGE_REQUESTS_H

#include <stdbool.h>
#include <stdint.h>

#include "framing.h"
#include "protocol.h"

/* A request that changes something and carries a stamp. */
bool is_command(uint8_t opcode);

/* The first of UNKNOWN_OPCODE, NOT_CAPABLE, BAD_LENGTH, BAD_VALUE and BAD_ADDRESS that applies, or NOT_REFUSED. */
enum refusal fault_of(const struct frame *frame, bool can_sample);

#endif
