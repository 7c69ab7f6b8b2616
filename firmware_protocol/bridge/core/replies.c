#include "replies.h"

void reply_to(const struct frame *frame)
{
    reply_begin(frame->sequence, (uint8_t)(frame->opcode | REPLY_BIT));
}

void acknowledge(const struct frame *frame)
{
    reply_to(frame);
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
