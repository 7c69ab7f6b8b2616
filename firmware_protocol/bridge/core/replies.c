#include "replies.h"

#include "framing.h"

void acknowledge(uint16_t sequence, uint8_t opcode)
{
    reply_begin(sequence, (uint8_t)(opcode | REPLY_BIT));
    reply_send();
}

void refuse(uint16_t sequence, uint8_t opcode, enum refusal reason)
{
    reply_begin(sequence, REFUSED);
    reply_u8(opcode);
    reply_u8((uint8_t)reason);
    reply_send();
}

void reply_reading(const struct reading *reading)
{
    reply_u16(reading->set_point);
    reply_u16(reading->position);
    reply_u16((uint16_t)reading->error);
    reply_u8((uint8_t)reading->power);
}
