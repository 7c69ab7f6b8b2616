/* Following the controller by watching its memory.
 *
 * Once a period the controller stores what it measured, and some bit of six positions of 12 bits changes nearly every
 * time, since converters are noisy. The first change that is seen gives the phase. From then on the bridge looks only
 * around the time when the next results are due, and counts periods by its own clock if nothing changes. */
#include "period.h"

#include <stddef.h>
#include <string.h>

#include "moments.h"
#include "registers.h"
#include "ring.h"
#include "sampling.h"
#include "session.h"
#include "stop.h"

/* From the storing of a period's results to the next period, which begins with the fetch of set points. Assumed: the
 * mock's computing delay of 6 ms. If it is wrong, set points may be reported with a tick that is one off. */
#define FETCH_AFTER_STORED_US (PERIOD_US - 6000u)
/* The memory is left alone for so long around the fetch: longer than the bridge's longest access, and than the fetch. */
#define CLEAR_BEFORE_FETCH_US 600u
#define CLEAR_AFTER_FETCH_US 500u
/* Longer than the controller takes to store all results of a period (assumed, as in PROTOCOL.md, section 5). */
#define STORING_US 2000u
/* Between the two readings of a snapshot, and between further ones while they disagree. After a change that was seen to
 * happen, all is stored when the first begins. Without one, results may be stored at any moment: the second reading
 * then begins when any change that the first has met is complete. */
#define READ_AGAIN_US 100u
#define READ_AGAIN_UNSURE_US STORING_US
/* A change was seen to happen if the look before it was no longer ago than this. */
#define JUST_NOW_US 1500u
/* A snapshot that has not become whole by then, after its results began to be stored, is missing. */
#define GIVE_UP_US 8000u

/* A snapshot so old is not of the newest period: the signal for periods has failed, or no reading has become whole. */
#define OLD_AFTER_US (2u * PERIOD_US)

/* A look is a reading of all positions. While nothing is known, one a millisecond: each may cost the controller a
 * fetch. Around the due moment, more often. Where periods are not followed, only a loss of supply is looked for. */
#define SEARCH_EVERY_US 1000u
#define EXPECT_EVERY_US 200u
#define SUPPLY_EVERY_US 40000u
#define EXPECT_EARLY_US 500u
#define EXPECT_LATE_US 1000u
/* After so many periods without any change the controller has stopped, or its board is not the one expected. */
#define MOST_UNCHANGED_PERIODS 25u
/* A result that comes late moves the expected moment by this part of the delay, so that clocks may differ by 1 %; one
 * that comes early moves it at once, since a change may be seen late but never early. */
#define LATE_SHARE 2u

enum following {
    SEARCHING, /* the phase is unknown */
    EXPECTING, /* the next results are due PERIOD_US after the last */
    SETTLING   /* results are being stored, or are read */
};

static enum period_source source;
static enum following following;
static uint32_t tick; /* number of the period whose results were stored last */
static bool has_supply;
static uint16_t positions[JOINTS]; /* at the last look */
static uint8_t unchanged_periods;
static struct snapshot first_reading;
static bool is_read_once;
static uint16_t read_again_us;
static uint8_t periods_to_take; /* results still to come before those that must show what is in the set points */
static uint32_t missed;

/* Nothing is known of the controller: the state at the start, and after a reset of the board. */
static void forget(void)
{
    following = SEARCHING;
    tick = 0;
    unchanged_periods = 0;
    is_read_once = false;
    periods_to_take = 0;
    ring_clear();
}

void period_start(enum period_source period_source)
{
    source = period_source;
    has_supply = true;
    missed = 0;
    forget();
    (void)read_positions(positions);
}

bool period_newest_is_current(void)
{
    return us_since(SNAPSHOT_KEPT) < OLD_AFTER_US && ring_newest() != NULL && tick - ring_newest_tick() <= 1u;
}

/* Whether so much time has passed since the latest results began to be stored. */
static bool has_passed(uint16_t us)
{
    return following != SEARCHING && us_since(RESULTS_STORED) >= us;
}

uint32_t period_tick(void)
{
    return has_passed(FETCH_AFTER_STORED_US) ? tick + 1u : tick;
}

bool period_wants_memory(void)
{
    return has_passed(FETCH_AFTER_STORED_US - CLEAR_BEFORE_FETCH_US) &&
           !has_passed(FETCH_AFTER_STORED_US + CLEAR_AFTER_FETCH_US);
}

void period_set_points_written(void)
{
    periods_to_take = period_tick() == tick ? 1 : 2;
}

uint32_t period_missed_set_points(void)
{
    return missed;
}

/* ---- the board's supply */

static void begin_new_life(void)
{
    session_board_was_reset();
    sampling_board_was_reset();
    forget();
}

/* Reads the positions. True when they differ from the last look, and the board had its supply at both. */
static bool look(void)
{
    const bool differ = read_positions(positions);
    const bool powered = !all_zero(positions);
    const bool changed = has_supply && powered && differ;
    if (powered != has_supply && (!powered || session_is_open())) {
        begin_new_life(); /* when the supply fails, and when it returns to hosts that have greeted meanwhile */
    }
    has_supply = powered;
    moment_was(POSITIONS_SEEN, 0);
    return changed;
}

static bool look_is_due(uint16_t every_us)
{
    return us_since(POSITIONS_SEEN) >= every_us;
}

/* ---- snapshots */

static void read_snapshot(struct snapshot *snapshot)
{
    snapshot->status = 0;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        read_joint(joint, &snapshot->joints[joint]);
    }
}

/* Puts in the set points that the controller took, which are not those in the memory while it has missed some, or when
 * others were written since. */
static void keep_snapshot(struct snapshot *snapshot)
{
    bool missed_one = false;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        missed_one |= !put_in_taken(&snapshot->joints[joint]);
    }
    missed_one &= periods_to_take == 0;
    snapshot->status = (uint8_t)((stop_is_in_force() ? STATUS_FROZEN : 0) | (missed_one ? STATUS_SET_POINT_MISSED : 0));
    missed += missed_one;
    ring_add(tick, snapshot);
    moment_was(SNAPSHOT_KEPT, 0);
}

/* ---- following */

/* One more period has ended. */
static void count_period(void)
{
    ++tick;
    if (periods_to_take > 0) {
        --periods_to_take;
    }
}

/* The controller began so long ago to store a period's results. */
static void begin_settling(uint16_t ago_us, bool was_seen)
{
    moment_was(RESULTS_STORED, ago_us);
    read_again_us = was_seen ? READ_AGAIN_US : READ_AGAIN_UNSURE_US;
    count_period();
    following = SETTLING;
    is_read_once = false;
}

static void search(void)
{
    const uint16_t since_us = us_since(RESULTS_STORED);
    if (tick > 0 && since_us >= PERIOD_US) { /* once followed, ticks go on by the bridge's own clock */
        moment_was(RESULTS_STORED, (uint16_t)(since_us - PERIOD_US));
        count_period();
    }
    if (look_is_due(SEARCH_EVERY_US) && look()) {
        unchanged_periods = 0;
        begin_settling(0, true);
    }
}

static void expect(void)
{
    const uint16_t since_us = us_since(RESULTS_STORED);
    if (since_us < PERIOD_US - EXPECT_EARLY_US || !look_is_due(EXPECT_EVERY_US)) {
        return;
    }
    const uint16_t late_us = since_us < PERIOD_US ? 0 : (uint16_t)(since_us - PERIOD_US);
    const bool looked_just_now = us_since(POSITIONS_SEEN) < JUST_NOW_US;
    if (look()) {
        unchanged_periods = 0;
        begin_settling((uint16_t)(late_us - late_us / LATE_SHARE), looked_just_now);
    } else if (following == EXPECTING && late_us >= EXPECT_LATE_US) {
        if (++unchanged_periods > MOST_UNCHANGED_PERIODS) {
            following = SEARCHING;
            ring_clear();
        } else {
            begin_settling(late_us, false);
        }
    }
}

static void settle(void)
{
    if (!has_passed(STORING_US) || !look_is_due(read_again_us)) {
        return;
    }
    struct snapshot reading;
    read_snapshot(&reading);
    const bool agree = is_read_once && memcmp(&reading, &first_reading, sizeof reading) == 0;
    first_reading = reading;
    is_read_once = true;
    moment_was(POSITIONS_SEEN, 0);
    if (!agree && !has_passed(GIVE_UP_US)) {
        return;
    }
    following = EXPECTING;
    (void)look(); /* what the next results are compared with, and whether the board has its supply */
    if (agree && following == EXPECTING) {
        keep_snapshot(&reading);
    }
}

void period_work(void)
{
    if (source != PERIOD_WATCHED) {
        if (look_is_due(has_supply ? SUPPLY_EVERY_US : SEARCH_EVERY_US)) {
            (void)look();
        }
    } else if (following == SEARCHING) {
        search();
    } else if (following == EXPECTING) {
        expect();
    } else {
        settle();
    }
}

void period_ended(void)
{
    if (source != PERIOD_TOLD) {
        return;
    }
    struct snapshot reading;
    count_period();
    read_snapshot(&reading);
    keep_snapshot(&reading);
}
