/* The registers of the shared memory, by joint from 0, in the units of PROTOCOL.md. */
#ifndef BRIDGE_REGISTERS_H
#define BRIDGE_REGISTERS_H

#include <stdbool.h>
#include <stdint.h>

#include "protocol.h"

struct reading {
    uint16_t set_point; /* posture units */
    uint16_t position;  /* ADC counts */
    int16_t error;      /* ADC counts */
    int8_t power;       /* DAC counts */
};

/* Bytes of all positions, as they lie in the memory. */
#define POSITION_BYTES (2u * JOINTS)

/* Gains of a joint: proportional, integral, derivative. */
#define GAINS 3u

/* Reads a joint byte by byte: low and high byte may be of different periods. */
void read_joint(uint8_t joint, struct reading *reading);
uint16_t read_set_point(uint8_t joint);
void write_set_point(uint8_t joint, uint16_t posture);

void read_positions(uint8_t bytes[POSITION_BYTES]);
uint16_t position_in(const uint8_t bytes[POSITION_BYTES], uint8_t joint);

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

/* The set point that a controller has taken, by what it made of it: error = set point - position. */
uint16_t set_point_taken(const struct reading *reading);

#endif
