/* The Mega's firmware image on a simulated ATmega2560 (simavr), its bus checked cycle by cycle. A shared library. */
#ifndef MEGA2560_SIMULATOR_H
#define MEGA2560_SIMULATOR_H

#include <stdint.h>

#define CLOCKS_PER_US 16u

/* Rules of the bus that a cycle may break; docs/hardware.md has their source. Numbers are indices of bus_report.faults. */
enum bus_rule {
    CLOCK_IS_1_MHZ,         /* 1MHzE: a period of 1 us, half of it high */
    SELECT_SETUP,           /* NPGFC low 250 ns before 1MHzE rises */
    ADDRESS_SETUP,          /* address and R/W 300 ns before 1MHzE rises */
    HELD_AFTER_CYCLE,       /* address, R/W and NPGFC until 30 ns after 1MHzE falls */
    WRITE_DATA_SETUP,       /* data to be written 150 ns after 1MHzE has risen, at the latest */
    WRITE_DATA_HOLD,        /* and until 50 ns after it falls */
    ONE_CYCLE_PER_ACCESS,   /* NPGFC is low in one high half of 1MHzE */
    NOBODY_ELSE_DRIVES_DATA, /* the Mega leaves the data lines alone while it reads */
    BUS_RULES
};

struct bus_report {
    uint32_t reads;
    uint32_t writes;
    uint32_t faults[BUS_RULES];
    int32_t least_select_setup_ns;
    int32_t least_address_setup_ns;
    int32_t least_hold_ns; /* of NPGFC, address and R/W */
    int32_t least_data_hold_ns;
};

/* Loads an image into a new board, with an empty EEPROM, in place of the one before. `read_byte` and `write_byte` get
 * the moment (in clocks of 62.5 ns since the start) at which the cycle ends. Returns 0, or -1 when the image cannot be
 * read. */
int simulator_start(const char *image, uint8_t (*read_byte)(uint16_t address, uint64_t clock),
                    void (*write_byte)(uint16_t address, uint8_t value, uint64_t clock));

/* Presses the reset button: the EEPROM is kept. */
void simulator_reset(void);

/* Runs the processor up to a clock; returns 0, or -1 when it has crashed. */
int simulator_run(uint64_t clock);
uint64_t simulator_clock(void);

/* Bytes for the UART, and from it; how many it took, or gave. */
int simulator_take(const uint8_t *bytes, int count);
int simulator_give(uint8_t *bytes, int room);

const struct bus_report *simulator_bus_report(void);

/* Bytes of the stack that have been used at most since the start. */
uint32_t simulator_stack_bytes(void);

#endif
