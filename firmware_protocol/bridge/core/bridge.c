/* Carries out requests, and implements the interface of the core (core.h). */
#include "core.h"

#include "framing.h"
#include "moments.h"
#include "numbers.h"
#include "period.h"
#include "registers.h"
#include "replies.h"
#include "requests.h"
#include "ring.h"
#include "sampling.h"
#include "session.h"
#include "stop.h"

static bool can_sample;
static bool simulated;

void bridge_start(const struct bridge_settings *settings)
{
    can_sample = settings->period_source != PERIOD_UNSEEN;
    simulated = settings->simulated;
    moments_start();
    framing_start();
    session_start(settings->first_number);
    stop_start(settings->frozen);
    sampling_start();
    period_start(settings->period_source);
}

/* ---- requests that only read, each into a reply that has been begun */

static void hello(const struct frame *frame)
{
    const bool is_this_version = frame->length > 0 && frame->payload[0] == PROTOCOL_VERSION;
    reply_u8(PROTOCOL_VERSION);
    reply_u16((uint16_t)((can_sample ? CAPABILITY_SAMPLE : 0) | (simulated ? CAPABILITY_SIMULATED : 0)));
    reply_u32(PERIOD_US);
    reply_u8(can_sample ? RING_DEPTH : 0);
    reply_u16(session_boots());
    if (is_this_version) { /* to a host of another version, in the form of version 1 */
        const uint32_t nonce = u32_at(frame->payload + 1);
        reply_u32(nonce);
        reply_u32(session_greet(nonce));
    }
}

static void read_block(const uint8_t *payload)
{
    const uint16_t address = u16_at(payload);
    for (uint8_t i = 0; i < payload[2]; ++i) {
        reply_u8(board_read_byte((uint16_t)(address + i)));
    }
}

#if HAS_GAINS
static void report_gains(void)
{
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        for (uint8_t gain = 0; gain < GAINS; ++gain) {
            reply_u8(read_gain(joint, gain));
        }
    }
}
#endif

static void report_errors_positions_powers(uint8_t mask)
{
    reply_u8(mask);
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        if (has_joint(mask, joint)) {
            struct reading reading;
            read_joint(joint, &reading);
            reply_reading(&reading);
        }
    }
}

#if HAS_PROCESS
static void read_process(void)
{
    reply_u8(read_inputs());
    reply_u8(read_outputs());
    reply_u8(read_gripper());
}
#endif

static void reply_tick_and_status(void)
{
    reply_u32(period_tick());
    reply_u8((uint8_t)((stop_is_in_force() ? STATUS_FROZEN : 0) | (session_restarted() ? STATUS_RESTARTED : 0)));
}

static void read_status(void)
{
    reply_tick_and_status();
    reply_u16(session_boots());
    reply_u32(period_missed_set_points());
    reply_u32(stop_number());
}

/* ---- commands: `values` is the payload after the stamp */

static void set_set_points(const uint8_t *values)
{
    const uint8_t mask = *values++;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        if (has_joint(mask, joint)) {
            write_set_point(joint, u16_at(values));
            values += 2;
        }
    }
}

static void write_block(const uint8_t *values, uint8_t count)
{
    const uint16_t address = u16_at(values);
    for (uint8_t i = 0; i < count; ++i) {
        board_write_byte((uint16_t)(address + i), values[2u + i]);
    }
}

static bool writes_set_points(const struct frame *frame)
{
    const uint8_t *values = frame->payload + STAMP_BYTES;
    return frame->opcode == WRITE_SET_POINTS ||
           (frame->opcode == WRITE_BLOCK &&
            block_reaches_set_points(u16_at(values), (uint8_t)(frame->length - STAMP_BYTES - 2u)));
}

/* The reason not to obey a command now, or NOT_REFUSED. A release is obeyed here, since its number decides. */
static enum refusal hindrance(const struct frame *frame)
{
    const enum refusal reason = session_judge(frame->payload);
    if (reason != NOT_REFUSED) {
        return reason;
    }
    if (frame->opcode == RELEASE) {
        return stop_release(u32_at(frame->payload + STAMP_BYTES)) ? NOT_REFUSED : OTHER_STOP;
    }
    return stop_is_in_force() && writes_set_points(frame) ? REFUSED_FROZEN : NOT_REFUSED;
}

static void obey(const struct frame *frame)
{
    const uint8_t *values = frame->payload + STAMP_BYTES;
    switch (frame->opcode) {
    case WRITE_SET_POINTS:
        set_set_points(values);
        break;
    case WRITE_BLOCK:
        write_block(values, (uint8_t)(frame->length - STAMP_BYTES - 2u));
        break;
#if HAS_GAINS
    case SET_GAINS:
        for (uint8_t gain = 0; gain < GAINS; ++gain) {
            write_gain((uint8_t)(values[0] - 1u), gain, values[1u + gain]);
        }
        break;
#endif
#if HAS_PROCESS
    case WRITE_OUTPUTS:
        write_outputs((uint8_t)((read_outputs() & (uint8_t)~values[0]) | (values[1] & values[0])));
        break;
    case SET_GRIPPER:
        write_gripper(values[0]);
        break;
#endif
    default: /* RELEASE is done */
        break;
    }
    if (writes_set_points(frame)) {
        moments_read_clock();
        period_set_points_written();
    }
    if (frame->opcode == WRITE_SET_POINTS) {
        reply_tick_and_status();
    }
}

/* ---- all requests */

static void carry_out(const struct frame *frame)
{
    switch (frame->opcode) {
    case HELLO:
        hello(frame);
        break;
    case READ_BLOCK:
        read_block(frame->payload);
        break;
#if HAS_GAINS
    case REPORT_GAINS:
        report_gains();
        break;
#endif
    case REPORT_ERRORS_POSITIONS_POWERS:
        report_errors_positions_powers(frame->payload[0]);
        break;
#if HAS_PROCESS
    case READ_PROCESS:
        read_process();
        break;
#endif
    case READ_STATUS:
        read_status();
        break;
    default:
        obey(frame);
        break;
    }
}

static void answer(const struct frame *frame)
{
    enum refusal reason = fault_of(frame, can_sample);
    if (reason == NOT_REFUSED && is_command(frame->opcode)) {
        reason = hindrance(frame);
    }
    if (reason != NOT_REFUSED) {
        refuse(frame->sequence, frame->opcode, reason);
    } else if (frame->opcode == SAMPLE) {
        sampling_request(frame->sequence, u32_at(frame->payload), frame->payload[4]);
    } else if (frame->opcode == STOP) {
        stop_request(frame->sequence);
    } else {
        reply_begin(frame->sequence, (uint8_t)(frame->opcode | REPLY_BIT));
        carry_out(frame);
        reply_send();
    }
}

/* ---- the interface */

bool bridge_wants_byte(void)
{
    moments_read_clock();
    return !framing_is_sending() && !stop_is_reading() && !period_wants_memory();
}

void bridge_take_byte(uint8_t byte)
{
    struct frame frame;
    if (!framing_is_sending() && !stop_is_reading() && framing_take_byte(byte, &frame)) {
        moments_read_clock();
        answer(&frame);
    }
}

int16_t bridge_next_byte(void)
{
    return framing_next_byte();
}

void bridge_work(void)
{
    moments_read_clock();
    period_work();
    if (!framing_is_sending()) {
        stop_work();
    }
    if (!framing_is_sending()) {
        sampling_work();
    }
}

void bridge_hang_up(void)
{
    session_end();
}

void bridge_period_ended(void)
{
    moments_read_clock();
    period_ended();
}

bool bridge_is_frozen(void)
{
    return stop_is_in_force();
}

uint32_t bridge_newest_number(void)
{
    return newest_number();
}
