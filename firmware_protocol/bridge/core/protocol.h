/* Names and limits of PROTOCOL.md, version 2. */
#ifndef BRIDGE_PROTOCOL_H
#define BRIDGE_PROTOCOL_H

#define PROTOCOL_VERSION 2u
#define PERIOD_US 20000u /* control period (section 6.2 of the source) */
#define JOINTS 6u
#define ALL_JOINTS 0x3Fu
#define LARGEST_PAYLOAD 48u
#define STAMP_BYTES 8u
#define LARGEST_SET_POINT 999u
#define LARGEST_GAIN 20u

#ifndef RING_DEPTH
#define RING_DEPTH 32u /* snapshots; at least 8 */
#endif

enum request {
    HELLO = 0x01,
    READ_BLOCK = 0x02,
    WRITE_BLOCK = 0x03,
    WRITE_SET_POINTS = 0x04,
    REPORT_GAINS = 0x06,
    SET_GAINS = 0x07,
    REPORT_ERRORS_POSITIONS_POWERS = 0x08,
    SAMPLE = 0x10,
    STOP = 0x20,
    RELEASE = 0x21,
    READ_PROCESS = 0x30,
    WRITE_OUTPUTS = 0x31,
    SET_GRIPPER = 0x32,
    READ_STATUS = 0x33,
    ADVANCE = 0x40
};

#define REPLY_BIT 0x80u /* a reply's opcode is its request's with this bit */
#define REFUSED 0xFFu

enum refusal {
    NOT_REFUSED = 0,
    UNKNOWN_OPCODE = 1,
    BAD_LENGTH = 2,
    BAD_ADDRESS = 3,
    BAD_VALUE = 4,
    NOT_CAPABLE = 5,
    REFUSED_FROZEN = 6,
    NOTHING_NEW = 7,
    STALE = 8,
    BAD_SESSION = 9,
    OTHER_STOP = 10
};

enum capability { CAPABILITY_SAMPLE = 1, CAPABILITY_SIMULATED = 4 };

enum status_flag { STATUS_FROZEN = 1, STATUS_RESTARTED = 2, STATUS_SET_POINT_MISSED = 4 };

#endif
