/* The core against random lines, times and memories: libFuzzer calls LLVMFuzzerTestOneInput with inputs of its choice.
 *
 * An input is a list of steps. Some put raw bytes on the line, some whole frames with a right CRC and, for commands, the
 * stamp of the present session: what lies behind frame and session is reached too. After every step the promises of the
 * core are checked; the sanitizers see to its memory. */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "../core/core.h"
#include "../core/framing.h"
#include "../core/memory_map.h"
#include "../core/protocol.h"
#include "../core/registers.h"
#include "../core/stop.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static uint8_t memory[MEMORY_SIZE];
static uint32_t now_us;
static uint8_t said[64]; /* the reply that is being received */
static uint8_t said_count;
static uint8_t session[4];
static uint32_t command;

static void promise(bool kept)
{
    if (!kept) {
        abort();
    }
}

uint8_t board_read_byte(uint16_t address)
{
    promise(block_is_inside(address, 1));
    now_us += 1;
    return memory[address - MEMORY_BASE];
}

void board_write_byte(uint16_t address, uint8_t value)
{
    promise(block_is_inside(address, 1));
    now_us += 1;
    memory[address - MEMORY_BASE] = value;
}

uint32_t board_time_us(void)
{
    return now_us;
}

/* What the bridge says is a whole frame of a length that belongs to it. */
static void check_reply(void)
{
    const uint8_t count = unstuff(said, said_count);
    promise(count >= 6 && count == said[0] + 6u && crc_of(said, count) == 0);
    promise(said[3] >= REPLY_BIT);
    if (said[3] == (HELLO | REPLY_BIT) && said[0] == 18u) {
        memcpy(session, said + 4 + 14, sizeof session);
        command = 1;
    }
}

static void listen(void)
{
    int16_t byte = 0;
    while ((byte = bridge_next_byte()) >= 0) {
        if (byte != 0) {
            promise(said_count < sizeof said);
            said[said_count++] = (uint8_t)byte;
        } else if (said_count > 0) {
            check_reply();
            said_count = 0;
        }
    }
}

static void say(uint8_t byte)
{
    for (unsigned patience = 0; !bridge_wants_byte() && patience < 50; ++patience) {
        now_us += 400;
        bridge_work();
        listen();
    }
    bridge_take_byte(byte);
    listen();
}

static void say_frame(uint8_t opcode, const uint8_t *payload, uint8_t length)
{
    uint8_t piece[1 + 54 + 1] = {0, length, 1, 0, opcode};
    memcpy(piece + 5, payload, length);
    const bool is_command = opcode == WRITE_BLOCK || opcode == WRITE_SET_POINTS || opcode == SET_GAINS ||
                            opcode == RELEASE || opcode == WRITE_OUTPUTS || opcode == SET_GRIPPER;
    if (is_command && length >= STAMP_BYTES && payload[0] != 0xFFu) { /* a first byte of FF leaves it foreign */
        ++command;
        memcpy(piece + 5, session, sizeof session);
        for (unsigned i = 0; i < 4; ++i) {
            piece[9 + i] = (uint8_t)(command >> (8 * i));
        }
    }
    const uint16_t crc = crc_of(piece + 1, (uint8_t)(length + 4u));
    piece[5 + length] = (uint8_t)(crc >> 8);
    piece[6 + length] = (uint8_t)crc;
    stuff(piece, (uint8_t)(length + 7u));
    say(0);
    for (unsigned i = 0; i < length + 7u; ++i) {
        say(piece[i]);
    }
    say(0);
}

static void start(uint8_t chosen)
{
    struct bridge_settings settings = {PERIOD_UNSEEN, false, false, 0xFFFFFFF0u};
    settings.period_source = (enum period_source)(chosen % 3u);
    settings.frozen = (chosen & 0x80u) != 0;
    said_count = 0;
    bridge_start(&settings);
}

static void note_set_points(uint16_t set_points[JOINTS])
{
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        set_points[joint] = read_set_point(joint);
    }
}

static void step(uint8_t kind, const uint8_t *bytes, uint8_t count)
{
    static const uint8_t requests[] = {HELLO, READ_BLOCK, WRITE_BLOCK, WRITE_SET_POINTS, REPORT_GAINS, SET_GAINS,
                                       REPORT_ERRORS_POSITIONS_POWERS, SAMPLE, STOP, RELEASE, READ_PROCESS,
                                       WRITE_OUTPUTS, SET_GRIPPER, READ_STATUS, ADVANCE};
    const uint8_t what = kind & 0x1Fu;
    if (what < sizeof requests) {
        say_frame(requests[what], bytes, count < LARGEST_PAYLOAD ? count : LARGEST_PAYLOAD);
    } else if (what < 20u) {
        for (uint8_t i = 0; i < count; ++i) {
            say(bytes[i]);
        }
    } else if (what < 25u) {
        const uint32_t step_us = count > 0 ? 1u + bytes[0] * 97u : 1000u;
        for (unsigned i = 0; i < 12; ++i) {
            now_us += step_us;
            bridge_work();
            listen();
        }
    } else if (what < 29u) {
        for (uint8_t i = 0; i + 1u < count; i = (uint8_t)(i + 2u)) {
            memory[0x10u + bytes[i] % 0x60u] = bytes[i + 1u]; /* not the set points, which only the bridge writes */
        }
    } else if (what == 29u) {
        bridge_period_ended();
        listen();
    } else if (what == 30u) {
        memset(memory, 0, sizeof memory);
    } else {
        start(count > 0 ? bytes[0] : 0);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0) {
        return 0;
    }
    memset(memory, 0x5A, sizeof memory);
    memset(session, 0, sizeof session);
    start(data[0]);
    size_t at = 1;
    while (at + 2 <= size) {
        const uint8_t kind = data[at];
        const size_t left = size - at - 2;
        const uint8_t count = (uint8_t)(data[at + 1] % 64u < left ? data[at + 1] % 64u : left);
        const bool was_frozen = bridge_is_frozen() && !stop_is_reading();
        uint16_t before[JOINTS];
        uint16_t after[JOINTS];
        note_set_points(before);
        step(kind, data + at + 2, count);
        note_set_points(after);
        const bool may_move = (kind & 0x1Fu) >= 20u || (kind & 0x1Fu) == 8u; /* time, memory, restarts, a stop */
        promise(may_move || !was_frozen || !bridge_is_frozen() || memcmp(before, after, sizeof before) == 0);
        at += 2u + count;
    }
    return 0;
}
