#include "session.h"

#include "numbers.h"

static uint32_t newest_given; /* of the numbers of sessions and stops */
static uint32_t present;      /* number of the present session; 0 for none */
static uint32_t present_nonce;
static uint32_t newest_command;
static uint16_t boots;
static bool restarted;

void session_start(uint32_t first_number)
{
    newest_given = first_number;
    boots = 0;
    session_board_was_reset();
}

uint32_t fresh_number(void)
{
    ++newest_given;
    if (newest_given == 0) {
        newest_given = 1;
    }
    return newest_given;
}

uint32_t newest_number(void)
{
    return newest_given;
}

uint32_t session_greet(uint32_t nonce)
{
    if (present == 0 || nonce != present_nonce) {
        present = fresh_number();
        present_nonce = nonce;
        newest_command = 1;
        restarted = false;
    }
    return present;
}

void session_end(void)
{
    present = 0;
}

bool session_is_open(void)
{
    return present != 0;
}

void session_board_was_reset(void)
{
    session_end();
    restarted = true;
    ++boots;
}

enum refusal session_judge(const uint8_t *stamp)
{
    const uint32_t number = u32_at(stamp + 4);
    if (present == 0 || u32_at(stamp) != present) {
        return BAD_SESSION;
    }
    if (number < newest_command) {
        return STALE;
    }
    newest_command = number;
    return NOT_REFUSED;
}

bool session_restarted(void)
{
    return restarted;
}

uint16_t session_boots(void)
{
    return boots;
}
