/* Frames: COBS and CRC-16 (PROTOCOL.md, section 1). One frame comes in at a time, and one goes out. */
#ifndef BRIDGE_FRAMING_H
#define BRIDGE_FRAMING_H

#include <stdbool.h>
#include <stdint.h>

struct frame {
    uint16_t sequence;
    uint8_t opcode;
    uint8_t length; /* of the payload, in bytes */
    const uint8_t *payload;
};

uint16_t crc_of(const uint8_t *bytes, uint8_t count);

/* Stuffs in place what follows the first byte, which becomes the first code byte. */
void stuff(uint8_t *bytes, uint8_t count);

/* Undoes the stuffing in place: nothing becomes longer. Returns the number of bytes, 0 for broken stuffing. */
uint8_t unstuff(uint8_t *bytes, uint8_t count);

void framing_start(void);

/* Takes a byte of the line. True when it ends a whole frame; its payload is valid until the next byte. */
bool framing_take_byte(uint8_t byte, struct frame *frame);

/* Whether a reply is still to be sent. Another may be begun only when there is none. */
bool framing_is_sending(void);

/* The next byte of the reply, or -1. */
int16_t framing_next_byte(void);

/* A reply is begun, its payload is appended, and it is sent. */
void reply_begin(uint16_t sequence, uint8_t opcode);
void reply_u8(uint8_t value);
void reply_u16(uint16_t value);
void reply_u32(uint32_t value);
void reply_send(void);

#endif
