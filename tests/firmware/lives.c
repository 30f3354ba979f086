/* SPDX-License-Identifier: MIT */
#include "lives.h"
#include "amplifier.h"
#include "fake_board.h"
#include "lives_master.h"
#include "loop/loop.h"
#include "loop/loop_memory.h"
#include "master.h"
#include "protection/health_watch.h"
#include "random.h"
#include "registers/registers.h"
#include "store/parameter_store.h"
#include "unity.h"
#include "wire.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES_OF_A_LIFE = 40000, SAMPLES_BETWEEN_FAULTS = 2500, SERVES_TO_CATCH_UP = 400, COPIES = 16 };
/* A drive and its code differ by half a step, at the upper end by a whole one. */
#define CODE_STEP                    (1 << 16)
#define FALLBACK_HZ                  16000000U
#define PERIODS_TO_HARDWARE_WATCHDOG 19000U

typedef struct {
    uint32_t id;
    hyst_q31_t low, high; /* registers drive_low, drive_high */
    uint32_t address;
} copy_t;

static random_t rng;

static struct {
    uint64_t seed;
    unsigned long sample;
    uint32_t left[KINDS]; /* samples that it still lasts */
    unsigned long seen[KINDS], ended[KINDS];
    uint16_t code; /* of a sensor that is stuck */
    int32_t reading[HEALTH_CHANNELS];
    hyst_q31_t last, drives[FAKE_LATENCY];
    uint32_t state;
    lives_image_t image; /* in force, as far as it is known */
    lives_image_t next;
    bool adopting;
    hyst_q31_t low, high; /* registers */
    bool stage, permit;   /* an arming was accepted that has not had its stage yet */
    uint32_t in_fault;    /* samples, since anything was changed that it heads for */
    uint32_t silence, silence_at_least;
    uint32_t hung, unfed; /* periods since the main loop came round, since the hardware watchdog was fed */
    unsigned fed;
    unsigned long stalled; /* the last sample in which the main loop had stood still for too long */
    unsigned lossy,
        answers;           /* what was sent while nobody listened may be lost, up to some time after the next answer */
    copy_t stored[COPIES]; /* what a start may find; one of them */
    unsigned stored_count;
    bool kept[RULES];
} life;

static struct {
    unsigned long kinds[KINDS], states[AMPLIFIER_FAULT + 1], trips[16], restarts, loaded, cut, commits, adopted_moving,
        arms, saves;
    unsigned told;
} met;

static int32_t between(int32_t low, int32_t high) {
    return random_between(&rng, low, high);
}

static uint32_t any_bits(void) {
    return (uint32_t)random_bits(&rng);
}

static void keep(rule_t rule, bool held) {
    if (held || !life.kept[rule]) {
        return;
    }
    life.kept[rule] = false;
    if (met.told++ < 10) {
        printf("seed %" PRIu64 ", sample %lu, state %u, trip cause %u, drive %" PRId32 ": broken: %s, %s\n", life.seed,
               life.sample, (unsigned)life.state, (unsigned)loop.telemetry.trip_cause, life.last, rule_text[rule].fault,
               rule_text[rule].expected);
    }
}

static uint32_t read_now(uint16_t address, unsigned size) {
    uint16_t values[2];
    registers_read(address, (uint16_t)size, values);
    return size == 1 ? values[0] : (uint32_t)values[0] << 16 | values[1];
}

static hyst_q31_t effective_low(void) {
    return life.image.low > life.low ? life.image.low : life.low;
}

static hyst_q31_t effective_high(void) {
    return life.image.high < life.high ? life.image.high : life.high;
}

/* What the registers say is in force: it is what a master goes by. */
static void look_at_settings(void) {
    const uint32_t id = read_now(ADDRESS_active_model_id, 2);
    if (id != (life.adopting ? life.next.id : life.image.id)) {
        life.next = lives_image(id);
        life.adopting = true;
        met.commits++;
    }
    life.low = (hyst_q31_t)read_now(ADDRESS_drive_low, 2);
    life.high = (hyst_q31_t)read_now(ADDRESS_drive_high, 2);
}

/* A start */

static copy_t present_copy(void) {
    return (copy_t){.id = read_now(ADDRESS_active_model_id, 2),
                    .low = (hyst_q31_t)read_now(ADDRESS_drive_low, 2),
                    .high = (hyst_q31_t)read_now(ADDRESS_drive_high, 2),
                    .address = modbus_server_address()};
}

static bool same_copy(const copy_t *a, const copy_t *b) {
    return a->address == b->address &&
           (a->id == 0 ? b->id == 0 : a->id == b->id && a->low == b->low && a->high == b->high);
}

/* Without a stored image there is only the line. */
static void check_store(bool fallback) {
    copy_t found = present_copy();
    const uint32_t state = read_now(ADDRESS_store_state, 1);
    if (state == STORE_REFUSED) {
        keep(RULE_STORE, fallback); /* takes too long for the slow clock, and only then */
        return;
    }
    found.id = state == STORE_LOADED ? found.id : 0;
    met.loaded += state == STORE_LOADED ? 1UL : 0UL;
    bool one = false;
    for (unsigned i = 0; i < life.stored_count; i++) {
        one = one || same_copy(&found, &life.stored[i]);
    }
    keep(RULE_STORE, one);
    life.stored[0] = found;
    life.stored_count = 1;
}

static void start(uint16_t cause, bool fallback) {
    const board_start_t power = {
        .reset_cause = cause, .starts = 1, .faults = fallback ? (uint16_t)FAULT_CLOCK_FALLBACK : (uint16_t)0};
    fake_core_hz = fallback ? FALLBACK_HZ : 168000000U;
    (void)fake_store_power_on();
    fake_store.stuck = false;
    fake_board_start_locked(&power);
    wire_start();
    lives_master_start();
    for (unsigned i = 0; i < HEALTH_CHANNELS; i++) {
        life.reading[i] = fake_board.health[i];
    }
    memset(life.left, 0, sizeof life.left);
    life.hung = life.unfed = life.fed = life.silence = life.silence_at_least = life.in_fault = 0;
    life.lossy = life.answers = 0;
    life.adopting = life.stage = life.permit = false;
    life.state = AMPLIFIER_OFF;
    life.image = lives_image(read_now(ADDRESS_active_model_id, 2));
    look_at_settings();
    life.adopting = false;
    life.last = (hyst_q31_t)((uint32_t)(loop_park_code() ^ BOARD_CODE_MIDDLE) << 16);
    check_store(fallback);
    keep(RULE_STATES, read_now(ADDRESS_unlocked, 1) == 0 && !loop_armed());
}

static void restart(uint16_t cause) {
    met.restarts++;
    start(cause, between(0, 7) == 0);
}

/* Faults */

static bool is(kind_t kind) {
    return life.left[kind] > 0;
}

/* An image whose coefficients change while it is off, and which is then armed: the self test is to find it. */
static void change_memory(void) {
    static const uint16_t keys[] = {CONTROL_KEY_OUTPUT}, arm[] = {COMMAND_ARM};
    if (!loop_off()) {
        life.left[MEMORY] = 0;
        return;
    }
    char *at = (char *)&loop.active->compensator.drive_park;
    at += between(0, (int32_t)(sizeof loop.active->compensator - offsetof(hyst_compensator_t, drive_park)) - 1);
    const char bit = (char)(1U << between(0, 7));
    *at = (char)(*at ^ bit);
    (void)registers_write(ADDRESS_unlock, 1, keys);
    if (registers_write(ADDRESS_command, 1, arm) == MODBUS_OK) {
        wire.certain[wire.count] = true;
        wire.command[wire.count++] = COMMAND_ARM;
        wire.heard = wire.maybe_heard = true;
    } else {
        *at = (char)(*at ^ bit);
    }
}

static void begin(kind_t kind) {
    static const int32_t bad[HEALTH_CHANNELS][4] = {[HEALTH_TEMPERATURE] = {75000, 80001, -100000, HEALTH_ABSENT},
                                                    [HEALTH_SUPPLY] = {0, 2999, 3601, HEALTH_ABSENT},
                                                    [HEALTH_HIGH_VOLTAGE] = {0, 149999, 170001, HEALTH_ABSENT}};
    life.left[kind] = (uint32_t)between(1, kinds[kind].longest);
    met.kinds[kind]++;
    life.seen[kind]++;
    if (kind >= TEMPERATURE && kind <= HIGH_VOLTAGE) {
        life.reading[kind - TEMPERATURE] = bad[kind - TEMPERATURE][between(0, 3)];
    } else if (kind == SENSOR) {
        life.code = between(0, 1) == 0 ? (uint16_t)any_bits() : between(0, 1) == 0 ? UINT16_MAX : (uint16_t)0;
    } else if (kind == MEMORY) {
        change_memory();
    } else if (kind == RESTART) {
        restart(between(0, 1) == 0 ? RESET_SOFTWARE | RESET_FAULT : RESET_POWER);
    } else if (kind == POWER_CUT) {
        fake_store_cut_after((unsigned)between(0, 60), any_bits);
    } else if (kind == FLASH) {
        fake_store.stuck = true;
        fake_store.stuck_word = (size_t)between(0, 60);
    }
}

static void end(kind_t kind) {
    static const int32_t good[HEALTH_CHANNELS] = {FAKE_TEMPERATURE, FAKE_SUPPLY, FAKE_HIGH_VOLTAGE};
    life.ended[kind] = life.sample;
    if (kind >= TEMPERATURE && kind <= HIGH_VOLTAGE) {
        life.reading[kind - TEMPERATURE] = good[kind - TEMPERATURE];
    } else if (kind == POWER_CUT) {
        fake_store.cutting = false;
    } else if (kind == FLASH) {
        fake_store.stuck = false;
    } else if (kind == MAIN_LOOP_HANGS) {
        life.lossy = SERVES_TO_CATCH_UP;
        life.answers = wire.answers;
    }
}

static void go_on_with_faults(void) {
    for (unsigned kind = 0; kind < KINDS; kind++) {
        if (life.left[kind] > 0 && --life.left[kind] == 0) {
            end((kind_t)kind);
        }
    }
    if (between(1, SAMPLES_BETWEEN_FAULTS) == 1) {
        begin((kind_t)between(0, KINDS - 1));
    }
    for (unsigned i = 0; i < HEALTH_CHANNELS; i++) {
        fake_board.health[i] = life.reading[i];
    }
    wire_echoes(is(ECHO));
}

/* The main loop */

static bool command_taken(uint32_t command) {
    bool taken = false;
    for (unsigned i = 0; i < wire.count; i++) {
        taken = taken || wire.command[i] == command;
    }
    return taken;
}

static void note_commands(void) {
    bool out = life.state != AMPLIFIER_FAULT;
    for (unsigned i = 0; i < wire.count; i++) {
        const uint32_t command = wire.command[i];
        life.permit = (life.permit && (command != COMMAND_DISARM || !wire.certain[i])) || command == COMMAND_ARM;
        met.arms += command == COMMAND_ARM ? 1UL : 0UL;
        met.saves += command == COMMAND_SAVE ? 1UL : 0UL;
        out = out || command == COMMAND_STOP;
        keep(RULE_STATES, command != COMMAND_ARM || (out && parameter_store_image_given()));
    }
    life.silence = wire.maybe_heard ? 0 : life.silence;
    life.silence_at_least = wire.heard ? 0 : life.silence_at_least;
}

static void may_find(copy_t copy) {
    for (unsigned i = 0; i < life.stored_count; i++) {
        if (same_copy(&copy, &life.stored[i])) {
            return;
        }
    }
    TEST_ASSERT_LESS_THAN_UINT(COPIES, life.stored_count);
    life.stored[life.stored_count++] = copy;
}

/* What a start will find from here on: what the flash has taken, or what was there before a cut. Of several requests
 * that were read at once, the limits may be those of before or after. */
static void note_store(const copy_t *before, bool image, bool line, bool cut) {
    copy_t old[COPIES], now = present_copy();
    const unsigned count = life.stored_count;
    if ((!image && !line) || (!cut && read_now(ADDRESS_store_state, 1) != STORE_SAVED)) {
        return;
    }
    memcpy(old, life.stored, sizeof old);
    life.stored_count = cut ? count : 0;
    for (unsigned i = 0; i < count; i++) {
        copy_t next[] = {image ? *before : old[i], image ? now : old[i]};
        for (unsigned k = 0; k < 2; k++) {
            next[k].address = line ? read_now(ADDRESS_line_address, 1) : old[i].address;
            may_find(next[k]);
        }
    }
}

static void serve(void) {
    wire_settle();
    const bool image = wire_waits_for(COMMAND_SAVE), line = wire_waits_for(COMMAND_SAVE_LINE);
    const copy_t before = image ? present_copy() : life.stored[0];
    (void)amplifier_serve();
    if (fake_store.dead) {
        met.cut++;
        note_store(&before, image, line, true);
        restart(RESET_POWER);
        return;
    }
    wire_served();
    keep(RULE_LINE, !wire.unasked && (life.lossy > 0 || !wire.unanswered));
    if (life.lossy > 0 && !wire.unanswered && wire.answers != life.answers) {
        life.lossy--;
    }
    note_store(&before, command_taken(COMMAND_SAVE), command_taken(COMMAND_SAVE_LINE), false);
    look_at_settings();
}

static void main_loop(void) {
    if (fake_board.watchdog_fed != life.fed) {
        life.fed = fake_board.watchdog_fed;
        life.unfed = 0;
    }
    if (life.unfed > PERIODS_TO_HARDWARE_WATCHDOG) {
        restart(RESET_WATCHDOG);
    } else if (!is(MAIN_LOOP_HANGS)) {
        serve();
        life.hung = 0;
    }
}

/* A sample, and the rules */

static bool lawful(uint32_t before, uint32_t after) {
    bool reached[AMPLIFIER_FAULT + 1] = {false};
    reached[before] = true;
    for (unsigned i = 0; i <= wire.count; i++) {
        const uint32_t command = i < wire.count ? wire.command[i] : (uint32_t)COMMAND_NONE;
        bool next[AMPLIFIER_FAULT + 1] = {false};
        for (uint32_t from = 0; from <= AMPLIFIER_FAULT; from++) {
            for (uint32_t to = 0; reached[from] && to <= AMPLIFIER_FAULT; to++) {
                next[to] = next[to] || fake_board_lawful(from, to, command, true);
            }
        }
        memcpy(reached, next, sizeof reached);
    }
    return reached[after];
}

static bool moving(void) {
    return life.state == AMPLIFIER_CONDITIONING ||
           ((life.state == AMPLIFIER_HOLD || life.state == AMPLIFIER_RUN) && loop.mode != HYST_MODE_PARK);
}

static long long distance(hyst_q31_t a, hyst_q31_t b) {
    return llabs((long long)a - b);
}

static long long outside(hyst_q31_t drive) {
    return drive < effective_low()    ? distance(drive, effective_low())
           : drive > effective_high() ? distance(drive, effective_high())
                                      : 0;
}

/* Within the last look at each channel; or somebody has set other limits. */
static bool lately(kind_t kind) {
    return is(kind) || life.seen[SECOND_MASTER] > 0 ||
           (life.seen[kind] > 0 && life.sample - life.ended[kind] < 2UL * HEALTH_WATCH_TURN);
}

/* A cause that the last moments could have had. */
static bool has_cause(uint32_t cause, const loop_input_t *input) {
    const uint32_t timeout = read_now(ADDRESS_watchdog, 1);
    switch (1U << (cause - 1U)) {
    case FAULT_WATCHDOG:
        return timeout != 0 && life.silence_at_least + 1U + input->missed > timeout * 10U;
    case FAULT_OVERLOAD:
        return (input->faults & FAULT_OVERRUN) != 0;
    case FAULT_SUPPLY:
        return (input->faults & FAULT_SUPPLY) != 0 || lately(SUPPLY);
    case FAULT_TEMPERATURE:
        return lately(TEMPERATURE);
    case FAULT_HIGH_VOLTAGE:
        return lately(HIGH_VOLTAGE);
    case FAULT_CURRENT:
        return read_now(ADDRESS_current_limit, 2) != 0;
    case FAULT_STALL:
        return life.sample - life.stalled < 2UL * HEALTH_WATCH_TURN; /* it is looked at once a turn */
    case FAULT_IMAGE:
        return life.seen[MEMORY] > 0;
    default:
        return false;
    }
}

static void check_states(const loop_input_t *input) {
    const uint32_t before = life.state, after = loop.telemetry.amplifier_state;
    keep(RULE_STATES, lawful(before, after));
    keep(RULE_LATCH, before != AMPLIFIER_FAULT || after == AMPLIFIER_FAULT || command_taken(COMMAND_STOP));
    if (after == AMPLIFIER_FAULT && before != AMPLIFIER_FAULT) {
        met.trips[loop.telemetry.trip_cause & 15U]++;
        life.state = after;
        keep(RULE_CAUSE, has_cause(loop.telemetry.trip_cause, input));
        life.permit = false;
        life.in_fault = 0;
    }
    const bool was_moving = moving();
    life.state = after;
    met.states[after]++;
    life.silence = was_moving && moving() ? life.silence + 1U + input->missed : 0;
    life.silence_at_least += 1U + input->missed;
    const uint32_t timeout = read_now(ADDRESS_watchdog, 1);
    keep(RULE_SILENCE, timeout == 0 || life.silence <= timeout * 10U + 3U + input->missed);
}

static void check_stage(hyst_q31_t drive) {
    const bool on = fake_board.stage_enabled;
    if (on && !life.stage) {
        keep(RULE_STAGE, life.permit && distance(drive, life.image.park) <= CODE_STEP);
        life.permit = false;
    }
    keep(RULE_STAGE, !on || life.state != AMPLIFIER_OFF);
    life.stage = on;
}

/* The longest ramp: the whole range by the board's least slew in a fault, 0.5 s, and an adoption before it. */
enum { RAMP = 5000 + 200 };

static void check_drive(hyst_q31_t drive) {
    if (life.adopting && !loop_adoption_pending()) {
        met.adopted_moving += life.state >= AMPLIFIER_CONDITIONING && life.state <= AMPLIFIER_RUN ? 1UL : 0UL;
        life.image = life.next;
        life.adopting = false;
        life.in_fault = 0;
    }
    const hyst_q31_t slew = (hyst_q31_t)read_now(ADDRESS_drive_slew, 2);
    keep(RULE_STEP, distance(drive, life.last) <= slew + CODE_STEP);
    const long long was_outside = outside(life.last);
    const long long back = was_outside - (life.image.slew < slew ? life.image.slew : slew);
    keep(RULE_RANGE, outside(drive) <= (back > 0 ? back : 0) + 2 * CODE_STEP);
    if (life.state == AMPLIFIER_FAULT) {
        keep(RULE_RAMP, distance(drive, life.image.park) <= distance(life.last, life.image.park) + CODE_STEP);
        life.in_fault++;
        keep(RULE_RAMP, life.in_fault < RAMP || (distance(drive, life.image.park) <= CODE_STEP && !life.stage));
    }
    life.last = drive;
}

static void sample(void) {
    const bool late = is(LATE) && between(0, 2) != 0, missed = is(MISSED);
    const uint32_t periods = missed ? (uint32_t)between(1, between(0, 3) == 0 ? 20000 : 50) : 0;
    hyst_q31_t *const position = &life.drives[life.sample % FAKE_LATENCY];
    const uint16_t moved = (uint16_t)((uint32_t)*position >> 16 ^ BOARD_CODE_MIDDLE);
    const loop_input_t input = {.position_code = is(SENSOR) ? life.code : (uint16_t)(moved + (any_bits() & 3U)),
                                .missed = periods,
                                .faults = (is(CONVERTER) ? FAULT_CONVERTER_TIMEOUT : 0U) |
                                          (late || missed ? FAULT_OVERRUN : 0U) |
                                          (is(SUPPLY_SAGS) ? FAULT_SUPPLY : 0U)};
    fake_board.microseconds += FAKE_SAMPLE_US * (1U + periods);
    life.hung += 1U + periods;
    life.unfed += 1U + periods;
    life.stalled = life.hung + HEALTH_WATCH_TURN > HEALTH_WATCH_STALL_MS * 10U ? life.sample : life.stalled;
    note_commands();
    const hyst_q31_t drive = (hyst_q31_t)((uint32_t)(loop_sample(&input) ^ BOARD_CODE_MIDDLE) << 16);
    *position = drive;
    check_states(&input);
    check_drive(drive);
    check_stage(drive);
    wire_forget();
    life.sample++;
}

static void one_life(uint64_t seed) {
    fake_store_clear();
    memset(&life, 0, sizeof life);
    memset(life.kept, 1, sizeof life.kept);
    rng.state = life.seed = seed;
    lives_master_begin(&rng);
    life.stored_count = 1;
    life.stored[0].address = 1;
    start(RESET_POWER, false);
    while (life.sample < SAMPLES_OF_A_LIFE) {
        go_on_with_faults();
        if (!is(HOST_DIES)) {
            lives_master_byte();
        }
        if (is(GARBAGE) && between(0, 2) == 0) {
            if (between(0, 30) == 0) {
                wire_broken_byte();
            } else {
                wire_byte((uint8_t)any_bits());
            }
        }
        if (is(SECOND_MASTER)) {
            lives_stranger_byte();
        }
        main_loop();
        sample();
    }
}

static void print_what_was_met(unsigned long lives) {
    static const char *const states[] = {"off", "precharge", "conditioning", "hold", "run", "stop", "fault"};
    printf("%lu lives of %d samples:", lives, SAMPLES_OF_A_LIFE);
    for (unsigned i = 0; i < KINDS; i++) {
        printf("%s %s %lu", i == 0 ? "" : ",", kinds[i].name, met.kinds[i]);
    }
    printf("\nsamples in");
    for (unsigned i = 0; i <= AMPLIFIER_FAULT; i++) {
        printf(" %s %lu", states[i], met.states[i]);
    }
    printf("\n%lu restarts, %lu with a stored image, %lu cuts in a store, %lu saves, %lu armings, %lu images, %lu "
           "taken over "
           "in motion; trips by cause",
           met.restarts, met.loaded, met.cut, met.saves, met.arms, met.commits, met.adopted_moving);
    for (unsigned i = 1; i < 16; i++) {
        if (met.trips[i] > 0) {
            printf(" %u: %lu", i, met.trips[i]);
        }
    }
    printf("\n");
}

/* Lives in which nothing happens would hold any rule. */
static void expect_everything_met(void) {
    for (unsigned i = 0; i < KINDS; i++) {
        TEST_ASSERT_GREATER_THAN_UINT64_MESSAGE(0, met.kinds[i], kinds[i].name);
    }
    for (unsigned i = 0; i <= AMPLIFIER_FAULT; i++) {
        TEST_ASSERT_GREATER_THAN_UINT64_MESSAGE(SAMPLES_OF_A_LIFE, met.states[i], "a state that was hardly visited");
    }
    TEST_ASSERT_GREATER_THAN_UINT64(0, met.loaded);
    TEST_ASSERT_GREATER_THAN_UINT64(0, met.cut);
    TEST_ASSERT_GREATER_THAN_UINT64(0, met.adopted_moving);
}

lives_t lives_run(uint64_t seed, unsigned long lives) {
    lives_t result = {.lives = lives};
    memset(&met, 0, sizeof met);
    for (unsigned long i = 0; i < lives; i++) {
        one_life(seed + i);
        result.samples += life.sample;
        for (unsigned rule = 0; rule < RULES; rule++) {
            result.held[rule] += life.kept[rule] ? 1UL : 0UL;
        }
    }
    fake_board_sends = NULL;
    fake_core_hz = 168000000U;
    print_what_was_met(lives);
    if (lives >= 100) {
        expect_everything_met();
    }
    return result;
}
