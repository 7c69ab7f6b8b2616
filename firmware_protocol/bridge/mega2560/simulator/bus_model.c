/* What happens at the pins is timed in clocks of 62.5 ns. An instruction that begins in clock c changes its pins at the
 * end of it, c + 1. 1MHzE is where timer 0 is: it rises when the timer begins to count 0 (mega2560/bus.c). */
#include "bus_model.h"

#include <simavr/avr_ioport.h>
#include <simavr/sim_core.h>
#include <simavr/sim_cycle_timers.h>
#include <stdbool.h>
#include <string.h>

#define TCCR0A 0x44u
#define TCCR0B 0x45u
#define TCNT0 0x46u
#define OCR0A 0x47u
#define OCR0B 0x48u
#define PAGE 0xFC00u
#define NPGFC 0x01u
#define READ_NOT_WRITE 0x02u

#define HALF 8u             /* clocks of half a period of 1MHzE */
#define DATA_VALID_BEFORE 3u /* clocks before 1MHzE falls at which data to be read become right: 188 of 200 ns */
#define DATA_HELD_AFTER 1u  /* clocks after 1MHzE falls at which they become wrong again */
#define NS(clocks) ((int32_t)(clocks) * 125 / 2)

static avr_t *avr;
static uint8_t (*read_memory)(uint16_t, uint64_t);
static void (*write_memory)(uint16_t, uint8_t, uint64_t);
static struct bus_report report;

static uint64_t timer_since; /* when timer 0 was started */
static uint8_t address;
static uint8_t port_g;
static uint8_t data_out;
static uint8_t data_driven;
static uint64_t address_since; /* since when address and R/W are as they are */
static uint64_t data_since;
static uint64_t selected_since;
static uint64_t cycle_rises; /* of 1MHzE, in the latest access */
static uint64_t cycle_falls;

static void expect(enum bus_rule rule, bool kept)
{
    report.faults[rule] += !kept;
}

static void note_least(int32_t *least, int32_t value)
{
    if (value < *least) {
        *least = value;
    }
}

/* When 1MHzE rose last. */
static uint64_t last_rise(void)
{
    return avr->cycle - (avr->cycle - timer_since) % (2u * HALF);
}

/* Timer 0 as far as this firmware uses it, 0 to 15 with every clock: simavr's own would interrupt the simulation a
 * million times a second for it. check_clock() sees that it is set up so. */
static void timer_starts(avr_t *processor, avr_io_addr_t io, uint8_t value, void *parameter)
{
    (void)parameter;
    processor->data[io] = value;
    timer_since = processor->cycle + 1u;
}

static uint8_t timer_is_read(avr_t *processor, avr_io_addr_t io, void *parameter)
{
    (void)parameter;
    processor->data[io] = (uint8_t)((processor->cycle - timer_since) % (2u * HALF));
    return processor->data[io];
}

static void put_on_data_lines(uint8_t value)
{
    for (uint8_t bit = 0; bit < 8; ++bit) {
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), bit), (value >> bit) & 1u);
    }
}

static avr_cycle_count_t data_become_wrong(avr_t *processor, avr_cycle_count_t when, void *parameter)
{
    (void)processor;
    (void)when;
    put_on_data_lines((uint8_t)~(uintptr_t)parameter);
    return 0;
}

static avr_cycle_count_t data_become_right(avr_t *processor, avr_cycle_count_t when, void *parameter)
{
    (void)when;
    (void)parameter;
    const uint8_t value = read_memory((uint16_t)(PAGE + address), cycle_falls);
    put_on_data_lines(value);
    avr_cycle_timer_register(processor, DATA_VALID_BEFORE + DATA_HELD_AFTER, data_become_wrong, (void *)(uintptr_t)value);
    return 0;
}

static avr_cycle_count_t data_are_taken(avr_t *processor, avr_cycle_count_t when, void *parameter)
{
    (void)processor;
    (void)when;
    (void)parameter;
    write_memory((uint16_t)(PAGE + address), data_out, cycle_falls);
    return 0;
}

static void check_clock(void)
{
    expect(CLOCK_IS_1_MHZ, avr->data[TCCR0A] == 0x23u && avr->data[TCCR0B] == 0x09u && avr->data[OCR0A] == 15u &&
                               avr->data[OCR0B] == 7u);
}

static void select_falls(uint64_t clock)
{
    const uint64_t rise = last_rise() + 2u * HALF;
    selected_since = clock;
    cycle_rises = rise;
    cycle_falls = rise + HALF;
    check_clock();
    expect(ONE_CYCLE_PER_ACCESS, clock >= rise - HALF && clock < rise);
    const int32_t select_setup_ns = NS(rise - clock);
    const int32_t address_setup_ns = NS(rise - address_since);
    expect(SELECT_SETUP, select_setup_ns >= 250);
    expect(ADDRESS_SETUP, address_setup_ns >= 300);
    note_least(&report.least_select_setup_ns, select_setup_ns);
    note_least(&report.least_address_setup_ns, address_setup_ns);
    const avr_cycle_count_t to_fall = cycle_falls - avr->cycle;
    if ((port_g & READ_NOT_WRITE) != 0) {
        ++report.reads;
        expect(NOBODY_ELSE_DRIVES_DATA, data_driven == 0);
        avr_cycle_timer_register(avr, to_fall - DATA_VALID_BEFORE, data_become_right, NULL);
    } else {
        ++report.writes;
        expect(WRITE_DATA_SETUP, data_driven == 0xFFu && NS(data_since) <= NS(rise) + 150);
        avr_cycle_timer_register(avr, to_fall, data_are_taken, NULL);
    }
}

static void select_rises(uint64_t clock)
{
    const int32_t hold_ns = NS((int64_t)clock - (int64_t)cycle_falls);
    expect(HELD_AFTER_CYCLE, hold_ns >= 30);
    expect(ONE_CYCLE_PER_ACCESS, clock < cycle_rises + 2u * HALF);
    note_least(&report.least_hold_ns, hold_ns);
}

/* Something that has to hold still during a cycle changes. */
static void held_line_changes(uint64_t clock)
{
    if (clock > selected_since && selected_since != 0) {
        const int32_t hold_ns = NS((int64_t)clock - (int64_t)cycle_falls);
        expect(HELD_AFTER_CYCLE, hold_ns >= 30);
        note_least(&report.least_hold_ns, hold_ns);
    }
}

static void data_lines_change(uint64_t clock)
{
    if ((port_g & READ_NOT_WRITE) == 0 && selected_since != 0 && clock > selected_since) {
        const int32_t hold_ns = NS((int64_t)clock - (int64_t)cycle_falls);
        if (cycle_falls > data_since) { /* the data of the cycle that has just been, not those of the next */
            expect(WRITE_DATA_HOLD, hold_ns >= 50);
            note_least(&report.least_data_hold_ns, hold_ns);
        }
    }
    data_since = clock;
}

static void port_a_written(struct avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)parameter;
    const uint64_t clock = avr->cycle + 1u;
    if ((uint8_t)value != address) {
        held_line_changes(clock);
        address_since = clock;
    }
    address = (uint8_t)value;
}

static void port_c_written(struct avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)parameter;
    if ((uint8_t)value != data_out && data_driven != 0) {
        data_lines_change(avr->cycle + 1u);
    }
    data_out = (uint8_t)value;
}

static void port_c_turned(struct avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)parameter;
    if ((uint8_t)value != data_driven) {
        data_lines_change(avr->cycle + 1u);
    }
    data_driven = (uint8_t)value;
}

static void port_g_written(struct avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)parameter;
    const uint64_t clock = avr->cycle + 1u;
    const uint8_t before = port_g;
    port_g = (uint8_t)value;
    if (((before ^ port_g) & READ_NOT_WRITE) != 0) {
        held_line_changes(clock);
        address_since = clock;
    }
    if ((before & NPGFC) != 0 && (port_g & NPGFC) == 0) {
        select_falls(clock);
    } else if ((before & NPGFC) == 0 && (port_g & NPGFC) != 0) {
        select_rises(clock);
    }
}

void bus_model_start(avr_t *processor, uint8_t (*read_byte)(uint16_t, uint64_t),
                     void (*write_byte)(uint16_t, uint8_t, uint64_t))
{
    avr = processor;
    read_memory = read_byte;
    write_memory = write_byte;
    memset(&report, 0, sizeof report);
    report.least_select_setup_ns = report.least_address_setup_ns = INT32_MAX;
    report.least_hold_ns = report.least_data_hold_ns = INT32_MAX;
    timer_since = address_since = data_since = selected_since = cycle_rises = cycle_falls = 0;
    address = data_out = data_driven = 0;
    port_g = NPGFC | READ_NOT_WRITE;
    avr->io[AVR_DATA_TO_IO(TCCR0B)].w.c = timer_starts;
    avr->io[AVR_DATA_TO_IO(TCNT0)].r.c = timer_is_read;
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('A'), IOPORT_IRQ_REG_PORT), port_a_written, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), IOPORT_IRQ_REG_PORT), port_c_written, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('C'), IOPORT_IRQ_DIRECTION_ALL), port_c_turned,
                            NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('G'), IOPORT_IRQ_REG_PORT), port_g_written, NULL);
}

const struct bus_report *bus_model_report(void)
{
    return &report;
}
