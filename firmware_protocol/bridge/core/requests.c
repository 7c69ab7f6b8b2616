#include "requests.h"

#include "numbers.h"
#include "registers.h"

#define LENGTH_VARIES 0xFFu
#define NOT_A_REQUEST 0xFEu

bool is_command(uint8_t opcode)
{
    switch (opcode) {
    case WRITE_BLOCK:
    case WRITE_SET_POINTS:
    case SET_GAINS:
    case RELEASE:
    case WRITE_OUTPUTS:
    case SET_GRIPPER:
        return true;
    default:
        return false;
    }
}

/* Bytes of a request's payload. */
static uint8_t length_of(uint8_t opcode)
{
    switch (opcode) {
    case REPORT_GAINS:
    case STOP:
    case READ_PROCESS:
    case READ_STATUS:
        return 0;
    case REPORT_ERRORS_POSITIONS_POWERS:
        return 1;
    case READ_BLOCK:
        return 3;
    case ADVANCE:
        return 4;
    case SAMPLE:
        return 5;
    case SET_GRIPPER:
        return STAMP_BYTES + 1u;
    case WRITE_OUTPUTS:
        return STAMP_BYTES + 2u;
    case SET_GAINS:
    case RELEASE:
        return STAMP_BYTES + 4u;
    case HELLO:
    case WRITE_BLOCK:
    case WRITE_SET_POINTS:
        return LENGTH_VARIES;
    default:
        return NOT_A_REQUEST;
    }
}

/* Whether the memory map has what a request is about. */
static bool map_has(uint8_t opcode)
{
    switch (opcode) {
    case REPORT_GAINS:
    case SET_GAINS:
        return HAS_GAINS;
    case READ_PROCESS:
    case WRITE_OUTPUTS:
    case SET_GRIPPER:
        return HAS_PROCESS;
    default:
        return true;
    }
}

static bool mask_is_wrong(uint8_t mask)
{
    return mask == 0 || mask > ALL_JOINTS;
}

static enum refusal value_fault(bool wrong)
{
    return wrong ? BAD_VALUE : NOT_REFUSED;
}

static enum refusal hello_fault(const struct frame *frame)
{
    const bool is_this_version = frame->length > 0 && frame->payload[0] == PROTOCOL_VERSION;
    return is_this_version && frame->length != 5 ? BAD_LENGTH : NOT_REFUSED;
}

static enum refusal set_points_fault(const struct frame *frame)
{
    if (frame->length <= STAMP_BYTES) {
        return BAD_LENGTH;
    }
    const uint8_t mask = frame->payload[STAMP_BYTES];
    if (mask_is_wrong(mask)) {
        return BAD_VALUE;
    }
    uint8_t length = STAMP_BYTES + 1u;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        length = (uint8_t)(length + (has_joint(mask, joint) ? 2u : 0u));
    }
    if (frame->length != length) {
        return BAD_LENGTH;
    }
    for (uint8_t at = STAMP_BYTES + 1u; at < length; at = (uint8_t)(at + 2u)) {
        if (u16_at(frame->payload + at) > LARGEST_SET_POINT) {
            return BAD_VALUE;
        }
    }
    return NOT_REFUSED;
}

static enum refusal block_fault(uint16_t address, uint8_t count)
{
    return block_is_inside(address, count) ? NOT_REFUSED : BAD_ADDRESS;
}

static enum refusal write_block_fault(const struct frame *frame)
{
    if (frame->length < STAMP_BYTES + 3u) {
        return BAD_LENGTH;
    }
    return block_fault(u16_at(frame->payload + STAMP_BYTES), (uint8_t)(frame->length - STAMP_BYTES - 2u));
}

static enum refusal read_block_fault(const uint8_t *payload)
{
    const uint8_t count = payload[2];
    return count == 0 || count > LARGEST_PAYLOAD ? BAD_VALUE : block_fault(u16_at(payload), count);
}

static enum refusal gains_fault(const uint8_t *values)
{
    return value_fault(values[0] == 0 || values[0] > JOINTS || values[1] > LARGEST_GAIN || values[2] > LARGEST_GAIN ||
                       values[3] > LARGEST_GAIN);
}

enum refusal fault_of(const struct frame *frame, bool can_sample)
{
    const uint8_t length = length_of(frame->opcode);
    if (length == NOT_A_REQUEST) {
        return UNKNOWN_OPCODE;
    }
    if (frame->opcode == ADVANCE || (frame->opcode == SAMPLE && !can_sample) || !map_has(frame->opcode)) {
        return NOT_CAPABLE;
    }
    if (length != LENGTH_VARIES && frame->length != length) {
        return BAD_LENGTH;
    }
    switch (frame->opcode) {
    case HELLO:
        return hello_fault(frame);
    case READ_BLOCK:
        return read_block_fault(frame->payload);
    case WRITE_BLOCK:
        return write_block_fault(frame);
    case WRITE_SET_POINTS:
        return set_points_fault(frame);
    case SET_GAINS:
        return gains_fault(frame->payload + STAMP_BYTES);
    case REPORT_ERRORS_POSITIONS_POWERS:
        return value_fault(mask_is_wrong(frame->payload[0]));
    case SAMPLE:
        return value_fault(mask_is_wrong(frame->payload[4]));
    case SET_GRIPPER:
        return value_fault(frame->payload[STAMP_BYTES] > 1);
    default:
        return NOT_REFUSED;
    }
}
