/* The registers of the shared memory, by joint from 0, in the units of PROTOCOL.md. */
#ifndef BRIDGE_REGISTERS_H
#define BRIDGE_REGISTERS_H

#include <stdbool.h>
#include <stdint.h>

#include "memory_map.h"
#include "protocol.h"

/* A memory map may leave out the gains, and registers of process signals and gripper, if they are unknown. */
#ifdef GAIN_P_LOW
#define HAS_GAINS 1
#else
#define HAS_GAINS 0
#endif
#if defined(PROCESS_INPUTS_LOW) && defined(PROCESS_OUTPUTS_LOW) && defined(GRIPPER_LOW)
#define HAS_PROCESS 1
#else
#define HAS_PROCESS 0
#endif

/* Whether a mask has the bit of a joint. */
bool has_joint(uint8_t mask, uint8_t joint);

/* The memory's data of a joint, packed: 10 + 12 + 16 + 8 bits. */
struct reading {
    uint8_t set_point_low; /* posture units */
    uint8_t high_bits;     /* of the set point from bit 0 on, of the position from bit 4 on */
    uint8_t position_low;  /* ADC counts */
    uint8_t error[2];      /* ADC counts, two's complement, low byte first */
    uint8_t power;         /* DAC counts, two's complement */
};

/* Gains of a joint: proportional, integral, derivative. */
#define GAINS 3u

/* Reads a joint byte by byte: low and high byte may be of different periods. */
void read_joint(uint8_t joint, struct reading *reading);
uint16_t set_point_of(const struct reading *reading);
uint16_t position_of(const struct reading *reading);

uint16_t read_set_point(uint8_t joint);
void write_set_point(uint8_t joint, uint16_t posture);

/* Reads a position (ADC counts) byte by byte. */
uint16_t read_position(uint8_t joint);

/* Reads all positions. Returns whether any has changed. */
bool read_positions(uint16_t counts[JOINTS]);

/* Whether no position is other than 0: the memory of a board without supply. */
bool all_zero(const uint16_t counts[JOINTS]);

/* Only of a memory map that has them. */
uint8_t read_gain(uint8_t joint, uint8_t gain);
void write_gain(uint8_t joint, uint8_t gain, uint8_t value);

uint8_t read_inputs(void);
uint8_t read_outputs(void);
void write_outputs(uint8_t value);
uint8_t read_gripper(void);
void write_gripper(uint8_t closed);

/* Whether a block lies wholly in the shared memory; whether it reaches a set point. */
bool block_is_inside(uint16_t address, uint8_t count);
bool block_reaches_set_points(uint16_t address, uint8_t count);

/* Posture units of a position (ADC counts), rounded half up (PROTOCOL.md, section 8). */
uint16_t posture_of(uint16_t counts);

/* Puts in the set point that the controller has taken, by what it made of it: error = set point - position. False
 * where another one was read that it could have taken. */
bool put_in_taken(struct reading *reading);

#endif
