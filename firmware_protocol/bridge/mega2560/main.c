/* Arduino Mega 2560 as the bridge: host on UART 0, the MA2000's shared RAM on the 1 MHz bus. */
#include <avr/eeprom.h>
#include <avr/interrupt.h>

#include "../core/core.h"
#include "bus.h"
#include "clock.h"
#include "uart.h"

/* Data that survive a loss of power: the high half of the numbers given (PROTOCOL.md, section 3), and the freeze.
 * An empty EEPROM reads FF: a new board starts frozen, and the first release is an operator's. */
static uint16_t EEMEM kept_numbers;
static uint8_t EEMEM kept_freeze;
#define RELEASED 0x52u
#define FROZEN 0xFFu
/* The next high half is kept so many numbers before the low half wraps. */
#define BEFORE_WRAP 256ul

static uint16_t stored_numbers;
static uint8_t stored_freeze;

static void start_bridge(void)
{
    struct bridge_settings settings = {PERIOD_WATCHED, false, true, 0};
    stored_freeze = eeprom_read_byte(&kept_freeze) == RELEASED ? RELEASED : FROZEN;
    stored_numbers = (uint16_t)(eeprom_read_word(&kept_numbers) + 1u);
    eeprom_update_word(&kept_numbers, stored_numbers);
    settings.frozen = stored_freeze == FROZEN;
    settings.first_number = (uint32_t)stored_numbers << 16;
    bridge_start(&settings);
}

static void keep_state(void)
{
    const uint8_t freeze = bridge_is_frozen() ? FROZEN : RELEASED;
    const uint16_t numbers = (uint16_t)((bridge_newest_number() + BEFORE_WRAP) >> 16);
    if (freeze != stored_freeze) {
        stored_freeze = freeze;
        eeprom_update_byte(&kept_freeze, freeze);
    }
    if (numbers != stored_numbers) {
        stored_numbers = numbers;
        eeprom_update_word(&kept_numbers, numbers);
    }
}

/* Whether the line needs more work at once. */
static bool serve_line(void)
{
    bool busy = false;
    if (uart_can_send()) {
        const int16_t reply = bridge_next_byte();
        if (reply >= 0) {
            uart_send((uint8_t)reply);
            busy = true;
        }
    }
    if (bridge_wants_byte()) {
        const int16_t byte = uart_next_byte();
        if (byte >= 0) {
            bridge_take_byte((uint8_t)byte);
            busy = true;
        }
    }
    return busy;
}

int main(void)
{
    bus_start();
    clock_start();
    uart_start();
    sei();
    start_bridge();
    for (;;) {
        const bool busy = serve_line();
        bridge_work();
        keep_state();
        if (!busy) {
            clock_rest();
        }
    }
}
