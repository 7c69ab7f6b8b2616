#include "replies.h"

#include "framing.h"

void refuse(uint16_t sequence, uint8_t opcode, enum refusal reason)
{
    reply_begin(sequence, REFUSED);
    reply_u8(opcode);
    reply_u8((uint8_t)reason);
    reply_send();
}

void reply_reading(const struct reading *reading)
{
    reply_u16(set_point_of(reading));
    reply_u16(position_of(reading));
    reply_u8(reading->error[0]);
    reply_u8(reading->error[1]);
    reply_u8(reading->power);
}
