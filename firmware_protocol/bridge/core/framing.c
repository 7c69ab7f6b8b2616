#include "framing.h"

#include "numbers.h"
#include "protocol.h"

#define HEADER_BYTES 4u
#define CRC_BYTES 2u
#define LARGEST_BODY (HEADER_BYTES + LARGEST_PAYLOAD + CRC_BYTES)
#define LARGEST_PIECE (LARGEST_BODY + 1u) /* between two zeros */
#define LARGEST_FRAME (LARGEST_PIECE + 2u)

#define BODY_AT 2u /* in a frame: after the zero and the first code byte */

static uint8_t incoming[LARGEST_PIECE];
static uint8_t incoming_count;
static bool incoming_too_long;

static uint8_t outgoing[LARGEST_FRAME];
static uint8_t outgoing_count; /* bytes of the finished reply; 0 while there is none */
static uint8_t outgoing_sent;
static uint8_t outgoing_end; /* where the next byte of the payload goes */

void framing_start(void)
{
    incoming_count = 0;
    incoming_too_long = false;
    outgoing_count = 0;
    outgoing_sent = 0;
    outgoing_end = 0;
}

uint16_t crc_of(const uint8_t *bytes, uint8_t count)
{
    uint16_t crc = 0xFFFFu;
    for (; count > 0; --count, ++bytes) {
        crc = (uint16_t)(crc ^ ((uint16_t)*bytes << 8));
        for (uint8_t bit = 0; bit < 8; ++bit) {
            const uint16_t out = crc & 0x8000u;
            crc = (uint16_t)(crc << 1);
            if (out != 0) {
                crc ^= 0x1021u;
            }
        }
    }
    return crc;
}

uint8_t unstuff(uint8_t *bytes, uint8_t count)
{
    uint8_t left = 0;
    uint8_t kept = 0;
    for (uint8_t i = 0; i < count; ++i) {
        const uint8_t byte = bytes[i];
        if (left == 0) {
            if (i > 0) {
                bytes[kept++] = 0;
            }
            left = byte;
        } else {
            bytes[kept++] = byte;
        }
        --left;
    }
    return left == 0 ? kept : 0;
}

void stuff(uint8_t *bytes, uint8_t count)
{
    uint8_t code_at = 0;
    for (uint8_t i = 1; i < count; ++i) {
        if (bytes[i] == 0) {
            bytes[code_at] = (uint8_t)(i - code_at);
            code_at = i;
        }
    }
    bytes[code_at] = (uint8_t)(count - code_at);
}

/* Reads the piece between two zeros. */
static bool read_piece(struct frame *frame)
{
    const uint8_t count = unstuff(incoming, incoming_count);
    if (count < HEADER_BYTES + CRC_BYTES || count != incoming[0] + HEADER_BYTES + CRC_BYTES) {
        return false;
    }
    if (crc_of(incoming, count) != 0) {
        return false;
    }
    frame->length = incoming[0];
    frame->sequence = u16_at(incoming + 1);
    frame->opcode = incoming[3];
    frame->payload = incoming + HEADER_BYTES;
    return true;
}

bool framing_take_byte(uint8_t byte, struct frame *frame)
{
    if (byte != 0) {
        if (incoming_count == LARGEST_PIECE) {
            incoming_too_long = true;
        } else {
            incoming[incoming_count++] = byte;
        }
        return false;
    }
    const bool whole = incoming_count > 0 && !incoming_too_long && read_piece(frame);
    incoming_count = 0;
    incoming_too_long = false;
    return whole;
}

bool framing_is_sending(void)
{
    return outgoing_sent < outgoing_count;
}

int16_t framing_next_byte(void)
{
    return framing_is_sending() ? outgoing[outgoing_sent++] : -1;
}

void reply_begin(uint16_t sequence, uint8_t opcode)
{
    outgoing_count = 0;
    outgoing_sent = 0;
    outgoing_end = BODY_AT + 1u;
    reply_u16(sequence);
    reply_u8(opcode);
}

void reply_u8(uint8_t value)
{
    if (outgoing_end < BODY_AT + HEADER_BYTES + LARGEST_PAYLOAD) {
        outgoing[outgoing_end++] = value;
    }
}

void reply_u16(uint16_t value)
{
    reply_u8((uint8_t)value);
    reply_u8((uint8_t)(value >> 8));
}

void reply_u32(uint32_t value)
{
    reply_u16((uint16_t)value);
    reply_u16((uint16_t)(value >> 16));
}

void reply_send(void)
{
    uint8_t end = outgoing_end;
    outgoing[BODY_AT] = (uint8_t)(end - BODY_AT - HEADER_BYTES);
    const uint16_t crc = crc_of(outgoing + BODY_AT, (uint8_t)(end - BODY_AT));
    outgoing[end++] = (uint8_t)(crc >> 8);
    outgoing[end++] = (uint8_t)crc;
    stuff(outgoing + BODY_AT - 1u, (uint8_t)(end - BODY_AT + 1u));
    outgoing[0] = 0;
    outgoing[end++] = 0;
    outgoing_count = end;
}
