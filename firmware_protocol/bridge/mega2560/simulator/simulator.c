#include "simulator.h"

#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "bus_model.h"

#define CLOCK_HZ 16000000u
#define QUEUE_BYTES 4096u
#define UNTOUCHED 0xC5u /* fills the memory of the stack before the start */

struct queue {
    uint8_t bytes[QUEUE_BYTES];
    unsigned begin;
    unsigned end;
};

static avr_t *avr;
static struct queue to_uart;
static struct queue from_uart;
static bool uart_has_room;
static avr_irq_t *uart_input;

static bool queue_put(struct queue *queue, uint8_t byte)
{
    if (queue->end - queue->begin == QUEUE_BYTES) {
        return false;
    }
    queue->bytes[queue->end++ % QUEUE_BYTES] = byte;
    return true;
}

static bool queue_get(struct queue *queue, uint8_t *byte)
{
    if (queue->begin == queue->end) {
        return false;
    }
    *byte = queue->bytes[queue->begin++ % QUEUE_BYTES];
    return true;
}

static void uart_sends(struct avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)parameter;
    (void)queue_put(&from_uart, (uint8_t)value);
}

/* Hands over bytes until the UART says that it is full. */
static void feed_uart(void)
{
    uint8_t byte = 0;
    while (uart_has_room && queue_get(&to_uart, &byte)) {
        avr_raise_irq(uart_input, byte);
    }
}

static void uart_has_room_again(struct avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)value;
    (void)parameter;
    uart_has_room = true;
    feed_uart();
}

static void uart_is_full(struct avr_irq_t *irq, uint32_t value, void *parameter)
{
    (void)irq;
    (void)value;
    (void)parameter;
    uart_has_room = false;
}

/* Sleep takes no time of this computer: the caller says how far the clock may go. */
static void sleep_without_waiting(avr_t *processor, avr_cycle_count_t clocks)
{
    (void)processor;
    (void)clocks;
}

static void connect_uart(void)
{
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    uart_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), uart_sends, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), uart_has_room_again,
                            NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), uart_is_full, NULL);
}

static void discard_board(void)
{
    if (avr != NULL) {
        avr_terminate(avr);
        free(avr);
        avr = NULL;
    }
}

int simulator_start(const char *image, uint8_t (*read_byte)(uint16_t, uint64_t),
                    void (*write_byte)(uint16_t, uint8_t, uint64_t))
{
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    if (elf_read_firmware(image, &firmware) != 0) {
        return -1;
    }
    discard_board();
    avr = avr_make_mcu_by_name("atmega2560");
    if (avr == NULL || avr_init(avr) != 0) {
        return -1;
    }
    avr->frequency = CLOCK_HZ;
    avr->sleep = sleep_without_waiting;
    avr_load_firmware(avr, &firmware);
    memset(avr->data + avr->ramend / 2u, UNTOUCHED, avr->ramend / 2u);
    memset(&to_uart, 0, sizeof to_uart);
    memset(&from_uart, 0, sizeof from_uart);
    uart_has_room = true;
    connect_uart();
    bus_model_start(avr, read_byte, write_byte);
    return 0;
}

void simulator_reset(void)
{
    to_uart.begin = to_uart.end;
    uart_has_room = true;
    avr_reset(avr);
}

int simulator_run(uint64_t clock)
{
    feed_uart();
    while (avr->cycle < clock) {
        const int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            return -1;
        }
    }
    return 0;
}

uint64_t simulator_clock(void)
{
    return avr->cycle;
}

int simulator_take(const uint8_t *bytes, int count)
{
    int taken = 0;
    while (taken < count && queue_put(&to_uart, bytes[taken])) {
        ++taken;
    }
    return taken;
}

int simulator_give(uint8_t *bytes, int room)
{
    int given = 0;
    while (given < room && queue_get(&from_uart, &bytes[given])) {
        ++given;
    }
    return given;
}

const struct bus_report *simulator_bus_report(void)
{
    return bus_model_report();
}

uint32_t simulator_stack_bytes(void)
{
    uint32_t lowest = avr->ramend / 2u;
    while (lowest <= avr->ramend && avr->data[lowest] == UNTOUCHED) {
        ++lowest;
    }
    return avr->ramend + 1u - lowest;
}
