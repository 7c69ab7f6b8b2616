#include "registers.h"

#include "core.h"
#include "numbers.h"

#define MASK_OF(bits) ((uint16_t)((1ul << (bits)) - 1u))
#define LARGEST_ERROR ((int16_t)(MASK_OF(ERROR_BITS) >> 1))

static const uint8_t set_point_low[JOINTS] = SET_POINT_LOW;
static const uint8_t set_point_high[JOINTS] = SET_POINT_HIGH;
static const uint8_t position_low[JOINTS] = POSITION_LOW;
static const uint8_t position_high[JOINTS] = POSITION_HIGH;
static const uint8_t error_low[JOINTS] = ERROR_LOW;
#if ERROR_BITS > 8
static const uint8_t error_high[JOINTS] = ERROR_HIGH;
#endif
static const uint8_t power_low[JOINTS] = POWER_LOW;
#if HAS_GAINS
static const uint8_t gain_low[GAINS][JOINTS] = {GAIN_P_LOW, GAIN_I_LOW, GAIN_D_LOW};
#endif

/* Registers are given as distances from the beginning of the shared memory. */
static uint8_t read_at(uint8_t distance)
{
    return board_read_byte((uint16_t)(MEMORY_BASE + distance));
}

static void write_at(uint8_t distance, uint8_t value)
{
    board_write_byte((uint16_t)(MEMORY_BASE + distance), value);
}

static uint16_t read_word(uint8_t low, uint8_t high)
{
    const uint8_t low_byte = read_at(low);
    return (uint16_t)(low_byte | ((uint16_t)read_at(high) << 8));
}

uint16_t read_position(uint8_t joint)
{
    return (uint16_t)(read_word(position_low[joint], position_high[joint]) & MASK_OF(POSITION_BITS));
}

/* In 16 bits, whatever the memory has. */
static uint16_t read_error(uint8_t joint)
{
#if ERROR_BITS == 16
    return read_word(error_low[joint], error_high[joint]);
#else
#if ERROR_BITS > 8
    const uint16_t raw = (uint16_t)(read_word(error_low[joint], error_high[joint]) & MASK_OF(ERROR_BITS));
#else
    const uint16_t raw = read_at(error_low[joint]);
#endif
    const uint16_t sign = (uint16_t)(1u << (ERROR_BITS - 1));
    return (uint16_t)((raw ^ sign) - sign);
#endif
}

bool has_joint(uint8_t mask, uint8_t joint)
{
    return ((unsigned)mask >> joint & 1u) != 0;
}

void read_joint(uint8_t joint, struct reading *reading)
{
    const uint16_t set_point = read_set_point(joint);
    const uint16_t position = read_position(joint);
    const uint16_t error = read_error(joint);
    reading->set_point_low = (uint8_t)set_point;
    reading->high_bits = (uint8_t)((set_point >> 8) | ((position >> 8) << 4));
    reading->position_low = (uint8_t)position;
    reading->error[0] = (uint8_t)error;
    reading->error[1] = (uint8_t)(error >> 8);
    reading->power = read_at(power_low[joint]);
}

uint16_t set_point_of(const struct reading *reading)
{
    return (uint16_t)(reading->set_point_low | ((reading->high_bits & 0x03u) << 8));
}

uint16_t position_of(const struct reading *reading)
{
    return (uint16_t)(reading->position_low | ((reading->high_bits >> 4) << 8));
}

uint16_t read_set_point(uint8_t joint)
{
    return (uint16_t)(read_word(set_point_low[joint], set_point_high[joint]) & MASK_OF(SET_POINT_BITS));
}

void write_set_point(uint8_t joint, uint16_t posture)
{
    write_at(set_point_low[joint], (uint8_t)posture);
    write_at(set_point_high[joint], (uint8_t)(posture >> 8));
}

bool read_positions(uint16_t counts[JOINTS])
{
    bool differ = false;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        const uint16_t before = counts[joint];
        counts[joint] = read_position(joint);
        differ |= counts[joint] != before;
    }
    return differ;
}

bool all_zero(const uint16_t counts[JOINTS])
{
    uint16_t any = 0;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        any |= counts[joint];
    }
    return any == 0;
}

#if HAS_GAINS
uint8_t read_gain(uint8_t joint, uint8_t gain)
{
    return read_at(gain_low[gain][joint]);
}

void write_gain(uint8_t joint, uint8_t gain, uint8_t value)
{
    write_at(gain_low[gain][joint], value);
}
#endif

#if HAS_PROCESS
uint8_t read_inputs(void)
{
    return read_at(PROCESS_INPUTS_LOW);
}

uint8_t read_outputs(void)
{
    return read_at(PROCESS_OUTPUTS_LOW);
}

void write_outputs(uint8_t value)
{
    write_at(PROCESS_OUTPUTS_LOW, value);
}

uint8_t read_gripper(void)
{
    return (uint8_t)(read_at(GRIPPER_LOW) & 1u);
}

void write_gripper(uint8_t closed)
{
    write_at(GRIPPER_LOW, closed);
}
#endif

bool block_is_inside(uint16_t address, uint8_t count)
{
    return address >= MEMORY_BASE && address - MEMORY_BASE < MEMORY_SIZE &&
           count <= MEMORY_SIZE - (address - MEMORY_BASE);
}

bool block_reaches_set_points(uint16_t address, uint8_t count)
{
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        const uint16_t low = (uint16_t)(MEMORY_BASE + set_point_low[joint]);
        const uint16_t high = (uint16_t)(MEMORY_BASE + set_point_high[joint]);
        if ((uint16_t)(low - address) < count || (uint16_t)(high - address) < count) {
            return true;
        }
    }
    return false;
}

/* (2000 counts + 4096) div 8192, both over 16. Of 512 counts each, 125 come off exactly: so 16 bits suffice. */
uint16_t posture_of(uint16_t counts)
{
    const uint16_t posture = (uint16_t)(125u * (counts >> 9) + ((125u * (counts & 0x1FFu) + 256u) >> 9));
    return posture < LARGEST_SET_POINT ? posture : LARGEST_SET_POINT;
}

bool put_in_taken(struct reading *reading)
{
    const uint16_t in_memory = set_point_of(reading);
    const int16_t error = (int16_t)u16_at(reading->error);
    const uint16_t target = (uint16_t)(position_of(reading) + (uint16_t)error); /* far above, if below 0 */
    if (error >= LARGEST_ERROR || error <= -LARGEST_ERROR || target > MASK_OF(POSITION_BITS)) {
        return true; /* the memory's error is limited: it does not tell */
    }
    const uint16_t taken = posture_of(target);
    reading->set_point_low = (uint8_t)taken;
    reading->high_bits = (uint8_t)((reading->high_bits & 0xF0u) | (taken >> 8));
    return in_memory == taken || in_memory > LARGEST_SET_POINT;
}
