/* Following the controller by watching its memory.
 *
 * Once a period the controller stores what it measured, and some bit of six positions of 12 bits changes nearly every
 * time, since converters are noisy. The first change that is seen gives the phase. From then on the bridge looks only
 * around the moment when the next results are due, and counts periods by its own clock where nothing changes. */
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
static uint32_t tick;           /* number of the period whose results were stored last */
static uint32_t stored_us;      /* when their storing began */
static uint32_t looked_us;      /* when the memory was read last */
static bool has_looked;
static bool has_supply;
static uint8_t positions[POSITION_BYTES]; /* at the last look */
static uint8_t unchanged_periods;
static struct snapshot first_reading;
static bool is_read_once;
static uint16_t read_again_us;
static uint32_t written_tick; /* period_tick() when set points were written last */
static uint32_t missed;
static uint32_t kept_us; /* when the newest snapshot was put into the ring */
static bool kept_lately;

void period_start(enum period_source period_source)
{
    source = period_source;
    following = SEARCHING;
    tick = 0;
    has_looked = false;
    has_supply = true;
    unchanged_periods = 0;
    is_read_once = false;
    written_tick = 0;
    missed = 0;
    kept_lately = false;
    ring_clear();
}

/* Whether the newest snapshot was kept less than so long ago. Asked at every turn, so that the clock may wrap. */
static bool was_kept_lately(void)
{
    kept_lately = kept_lately && us_since(&kept_us) < OLD_AFTER_US;
    return kept_lately;
}

bool period_newest_is_current(void)
{
    return was_kept_lately() && ring_newest() != NULL && tick - ring_newest_tick() <= 1u;
}

/* Whether so much time has passed since the latest results began to be stored. */
static bool has_passed(uint16_t us)
{
    return following != SEARCHING && us_since(&stored_us) >= us;
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
    written_tick = period_tick();
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
    ring_clear();
    following = SEARCHING;
    tick = 0;
    written_tick = 0;
    unchanged_periods = 0;
    is_read_once = false;
}

/* A memory in which all positions are zero belongs to a board without supply. */
static bool all_zero(const uint8_t bytes[POSITION_BYTES])
{
    for (uint8_t i = 0; i < POSITION_BYTES; ++i) {
        if (bytes[i] != 0) {
            return false;
        }
    }
    return true;
}

/* Reads the positions. True when they differ from the last look, and the board had its supply at both. */
static bool look(void)
{
    uint8_t seen[POSITION_BYTES];
    read_positions(seen);
    const bool powered = !all_zero(seen);
    const bool changed = has_looked && has_supply && powered && memcmp(seen, positions, POSITION_BYTES) != 0;
    if (powered != has_supply && (!powered || session_is_open())) {
        begin_new_life(); /* when the supply fails, and when it returns to hosts that have greeted meanwhile */
    }
    has_supply = powered;
    has_looked = true;
    looked_us = present_us();
    memcpy(positions, seen, POSITION_BYTES);
    return changed;
}

static bool look_is_due(uint16_t every_us)
{
    return !has_looked || us_since(&looked_us) >= every_us;
}

/* ---- snapshots */

static void read_snapshot(struct snapshot *snapshot)
{
    snapshot->status = 0;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        struct reading reading;
        read_joint(joint, &reading);
        pack(&reading, snapshot->joints[joint]);
    }
}

/* Whether the controller has left set points in the memory that it should have taken in period `tick`. */
static bool has_missed(uint16_t in_memory, uint16_t taken)
{
    return written_tick < tick && in_memory <= LARGEST_SET_POINT && in_memory != taken;
}

/* Puts in the set points that the controller took, which are not those in the memory while it has missed some, or when
 * others were written since. */
static void keep_snapshot(struct snapshot *snapshot)
{
    bool missed_one = false;
    for (uint8_t joint = 0; joint < JOINTS; ++joint) {
        struct reading reading;
        unpack(snapshot->joints[joint], &reading);
        const uint16_t taken = set_point_taken(&reading);
        missed_one = missed_one || has_missed(reading.set_point, taken);
        reading.set_point = taken;
        pack(&reading, snapshot->joints[joint]);
    }
    snapshot->status = (uint8_t)((stop_is_in_force() ? STATUS_FROZEN : 0) | (missed_one ? STATUS_SET_POINT_MISSED : 0));
    missed += missed_one;
    ring_add(tick, snapshot);
    kept_us = present_us();
    kept_lately = true;
}

/* ---- following */

static void begin_settling(uint32_t began_us, bool was_seen)
{
    stored_us = began_us;
    read_again_us = was_seen ? READ_AGAIN_US : READ_AGAIN_UNSURE_US;
    ++tick;
    following = SETTLING;
    is_read_once = false;
}

static void search(void)
{
    if (tick > 0 && us_since(&stored_us) >= PERIOD_US) { /* once followed, ticks go on by the bridge's own clock */
        stored_us += PERIOD_US;
        ++tick;
    }
    if (look_is_due(SEARCH_EVERY_US) && look()) {
        unchanged_periods = 0;
        begin_settling(present_us(), true);
    }
}

/* When results that are seen now began to be stored. */
static uint32_t storing_began_us(uint16_t since_us)
{
    const uint16_t late_us = since_us < PERIOD_US ? 0 : (uint16_t)(since_us - PERIOD_US);
    return present_us() - (uint16_t)(late_us - late_us / LATE_SHARE);
}

static void expect(void)
{
    const uint16_t since_us = us_since(&stored_us);
    if (since_us < PERIOD_US - EXPECT_EARLY_US || !look_is_due(EXPECT_EVERY_US)) {
        return;
    }
    const bool looked_just_now = us_since(&looked_us) < JUST_NOW_US;
    if (look()) {
        unchanged_periods = 0;
        begin_settling(storing_began_us(since_us), looked_just_now);
    } else if (following == EXPECTING && since_us >= PERIOD_US + EXPECT_LATE_US) {
        if (++unchanged_periods > MOST_UNCHANGED_PERIODS) {
            following = SEARCHING;
            ring_clear();
        } else {
            begin_settling(stored_us + PERIOD_US, false);
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
    looked_us = present_us();
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
    (void)was_kept_lately();
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
    ++tick;
    read_snapshot(&reading);
    keep_snapshot(&reading);
}
