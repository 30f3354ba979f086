/* SPDX-License-Identifier: MIT */
/*
 * What can go wrong, at random moments of a random life, from one seed: what is expected, what was seen, whether it
 * held. The table goes to FAULTS_JSON, with the seed and the commit that repeat it. HYST_FAULT_RUNS sets how many lives
 * each fault gets (a hundred without it).
 *
 * In every life, whatever fails: no two drives are farther apart than the board allows, the drive is within the limits
 * of the image once it has been there, and the stage comes on only after an arming that was accepted.
 */
#include "amplifier.h"
#include "built_from.h"
#include "fake_board.h"
#include "lives.h"
#include "loop/loop.h"
#include "loop/loop_memory.h"
#include "master.h"
#include "protection/health_watch.h"
#include "random.h"
#include "store/image_store.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CODE_STEP (1 << 16)
#define LOW       (-(3 << 29))
#define HIGH      (3 << 29)
#define PARK      (-(1 << 29))
#define SLEW      (1 << 22)

static random_t rng;
static uint64_t seed;
static hyst_q31_t last;
static bool lawful; /* steps, limits and stage, so far in this life */
static bool stage;  /* on */
static bool armed;  /* accepted since the stage was last on */
static bool inside; /* the drive has been within the limits */

void setUp(void) {
}
void tearDown(void) {
}

static uint32_t any_bits(void) {
    return (uint32_t)random_bits(&rng);
}

static hyst_q31_t sample(loop_input_t input) {
    fake_board.microseconds += FAKE_SAMPLE_US;
    if (!fake_board.main_stalls) {
        health_watch_main_turned();
    }
    const hyst_q31_t drive = (hyst_q31_t)((uint32_t)(loop_sample(&input) ^ BOARD_CODE_MIDDLE) << 16);
    lawful = lawful && llabs((long long)drive - last) <= FAKE_DRIVE_SLEW_MAX + CODE_STEP;
    inside = inside || (drive >= LOW && drive <= HIGH);
    lawful = lawful && (!inside || (drive >= LOW - CODE_STEP && drive <= HIGH + CODE_STEP));
    lawful = lawful && (!fake_board.stage_enabled || stage || armed);
    armed = armed && !fake_board.stage_enabled;
    stage = fake_board.stage_enabled;
    last = drive;
    return drive;
}

static void run(unsigned samples) {
    for (unsigned i = 0; i < samples; i++) {
        (void)sample((loop_input_t){.position_code = (uint16_t)any_bits()});
    }
}

static uint32_t state(void) {
    return master_get(INDEX_amplifier_state);
}

static void arm(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, COMMAND_ARM));
    armed = true;
}

static size_t image_parked_at(hyst_q31_t park, uint32_t words[HYST_IMAGE_MAX_WORDS], uint32_t model) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.model_id = model;
    p.drive_low = LOW;
    p.drive_high = HIGH;
    p.drive_park = park;
    p.transition_slew = SLEW;
    return hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS);
}

static size_t image(uint32_t words[HYST_IMAGE_MAX_WORDS], uint32_t model) {
    return image_parked_at(PARK, words, model);
}

static void start(void) {
    const board_start_t power = {.reset_cause = RESET_POWER, .starts = 1};
    fake_board_start(&power);
    stage = armed = false;
    last = (hyst_q31_t)((uint32_t)(loop_park_code() ^ BOARD_CODE_MIDDLE) << 16);
}

/* Armed, and in one of many kinds of motion. */
static void live(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    fake_store_clear();
    start();
    lawful = true;
    inside = false;
    master_write_words(ADDRESS_staging, words, image(words, 1));
    master_command(COMMAND_COMMIT);
    run(3000);
    arm();
    run(1100);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, (uint32_t)random_between(&rng, 1, 3)));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint, any_bits()));
    run((unsigned)random_between(&rng, 0, 2000));
    if (random_between(&rng, 0, 1) == 0) {
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, 1));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_amplitude, any_bits()));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, (any_bits() >> 4) + 1U));
        master_command(COMMAND_START);
    }
    loop_master_heard();
    run((unsigned)random_between(&rng, 1, 1000)); /* at least one, that the registers show the start */
}

/* In a fault, at park after the ramp, and there until the command stop. */
static bool parked_by(uint32_t fault) {
    run(3000);
    const bool parked = last == PARK && state() == AMPLIFIER_FAULT && !fake_board.stage_enabled &&
                        (master_get(INDEX_faults_sticky) & fault) != 0;
    const bool refused = master_set(INDEX_command, COMMAND_ARM) == MODBUS_ILLEGAL_VALUE;
    master_command(COMMAND_STOP);
    run(3);
    return parked && refused && state() == AMPLIFIER_OFF;
}

static bool host_dies(void) {
    loop_master_heard();
    run(10001);
    return parked_by(FAULT_WATCHDOG);
}

static bool clock_too_slow(void) {
    for (unsigned i = 0; i < LOOP_OVERRUNS_TO_TRIP; i++) {
        (void)sample((loop_input_t){.faults = FAULT_OVERRUN});
    }
    return state() == AMPLIFIER_FAULT && parked_by(FAULT_OVERLOAD);
}

static bool single_late_samples(void) {
    const uint32_t before = state();
    for (unsigned i = 0; i < 50; i++) {
        (void)sample((loop_input_t){.faults = FAULT_OVERRUN});
        loop_master_heard();
        run((unsigned)random_between(&rng, 1, 20));
    }
    const uint32_t now = state();
    return now != AMPLIFIER_FAULT && (now == before || now == AMPLIFIER_HOLD) && master_get(INDEX_overruns) == 50;
}

static bool supply_sags(void) {
    (void)sample((loop_input_t){.faults = FAULT_SUPPLY});
    return state() == AMPLIFIER_FAULT && parked_by(FAULT_SUPPLY);
}

/* At random moments of the ramp and after it. */
static bool other_images_in_a_fault(void) {
    (void)sample((loop_input_t){.faults = FAULT_SUPPLY});
    for (unsigned i = 0; i < 10; i++) {
        uint32_t words[HYST_IMAGE_MAX_WORDS];
        const hyst_q31_t park = i < 9U ? random_between(&rng, LOW, HIGH) : PARK;
        master_write_words(ADDRESS_staging, words, image_parked_at(park, words, i + 2U));
        master_command(COMMAND_COMMIT);
        run((unsigned)random_between(&rng, 300, 3000)); /* longer than an adoption takes */
    }
    return state() == AMPLIFIER_FAULT && parked_by(FAULT_SUPPLY);
}

static bool converter_stuck(void) {
    loop_master_heard();
    for (unsigned i = 0; i < 500; i++) {
        (void)sample((loop_input_t){.faults = FAULT_CONVERTER_TIMEOUT});
    }
    return state() != AMPLIFIER_FAULT && (master_get(INDEX_faults_live) & FAULT_CONVERTER_TIMEOUT) != 0;
}

static bool reference_jumps(void) {
    for (unsigned i = 0; i < 50; i++) {
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint_slew, (uint32_t)HYST_Q31_MAX));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint, any_bits()));
        run(3);
    }
    return true; /* `lawful` is the answer */
}

static bool image_broken(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t length = image(words, 2);
    words[random_between(&rng, 0, (int32_t)length - 1)] ^= 1U << random_between(&rng, 0, 31);
    master_write_words(ADDRESS_staging, words, length);
    master_command(COMMAND_COMMIT);
    run(2);
    return master_get(INDEX_fault_code) != HYST_PARAMETERS_OK && master_get(INDEX_active_model_id) == 1;
}

static bool line_flips_bits(void) {
    uint8_t frame[MODBUS_FRAME_MAX], reply[MODBUS_FRAME_MAX];
    size_t reply_length;
    const uint8_t pdu[] = {6, 1, 0, 0, COMMAND_PARK};
    const size_t length = master_frame(frame, MASTER_SERVER, pdu, sizeof pdu);
    const hyst_mode_t mode = loop_mode();
    frame[random_between(&rng, 0, (int32_t)length - 1)] ^= (uint8_t)(1U << random_between(&rng, 0, 7));
    return modbus_serve(frame, length, reply, &reply_length) == MODBUS_FRAME_BROKEN && reply_length == 0 &&
           loop_mode() == mode;
}

static bool stored(uint32_t model) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    return image_store_load(words, HYST_IMAGE_MAX_WORDS) != 0 && words[3] == model;
}

static bool supply_goes_while_storing(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    TEST_ASSERT_TRUE(image_store_save(words, image(words, 10), NULL, 0));
    const size_t length = image(words, 11);
    fake_store_cut_after((unsigned)random_between(&rng, 0, 45), any_bits);
    const bool done = image_store_save(words, length, NULL, 0);
    (void)fake_store_power_on();
    const bool whole = done ? stored(11) : stored(10) || stored(11);
    start();
    run(10);
    return whole && last == PARK && state() == AMPLIFIER_OFF && !fake_board.stage_enabled;
}

static bool restart_under_motion(void) {
    start();
    run(100);
    return state() == AMPLIFIER_OFF && !fake_board.stage_enabled && last == HYST_Q31_MIN &&
           master_set(INDEX_mode, HYST_MODE_DIRECT) == MODBUS_ILLEGAL_VALUE;
}

/* More current on average than the stage may deliver. */
static bool current_too_high(void) {
    const uint32_t before = state();
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, 1));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_amplitude, HIGH));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, UINT32_MAX / 100U));
    master_command(COMMAND_START);
    run(100);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_current_limit, 1U << 24)); /* a sine of 100 Hz has some 2^26 */
    for (unsigned i = 0; i < 40 && state() != AMPLIFIER_FAULT; i++) {
        loop_master_heard();
        run(500);
    }
    return before != AMPLIFIER_FAULT && master_get(INDEX_trip_cause) == 7 && parked_by(FAULT_CURRENT);
}

static bool warned(uint32_t warning, unsigned samples, bool moves, uint16_t code) {
    loop_master_heard();
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint_slew, 1U << 21));
    master_command(COMMAND_STOP);
    for (unsigned i = 0; i < samples; i++) {
        if (moves && i % 400 == 0) {
            TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint, (uint32_t)(i % 800 == 0 ? LOW : HIGH)));
        }
        (void)sample((loop_input_t){.position_code = code});
    }
    const bool live = (master_get(INDEX_warnings_live) & warning) != 0;
    const bool goes_on = state() == AMPLIFIER_HOLD && (master_get(INDEX_faults_sticky) & FAULT_SUPPLY) == 0;
    run(3);
    return live && goes_on && (master_get(INDEX_warnings_live) & warning) == 0 &&
           (master_get(INDEX_warnings_sticky) & warning) != 0;
}

static bool sensor_lost(void) {
    return warned(2, 1005, false, random_between(&rng, 0, 1) == 0 ? 0 : UINT16_MAX);
}

static bool reading_stands_still(void) {
    return warned(4, 3000, true, (uint16_t)random_between(&rng, 1, 65534));
}

/* One look under the debounce count, then for good. Arming is refused while it lasts. */
static bool reading_trips(health_channel_t channel, int32_t bad, uint32_t fault) {
    enum { LOOK = HEALTH_WATCH_TURN };
    const int32_t good = fake_board.health[channel];
    fake_board.health[channel] = bad;
    loop_master_heard();
    run((HEALTH_WATCH_LOOKS - 1U) * LOOK);
    fake_board.health[channel] = good;
    run(LOOK);
    const bool early = state() == AMPLIFIER_FAULT;
    fake_board.health[channel] = bad;
    run((HEALTH_WATCH_LOOKS + 1U) * LOOK);
    return !early && state() == AMPLIFIER_FAULT && parked_by(fault);
}

static bool too_hot(void) {
    return reading_trips(HEALTH_TEMPERATURE, 80001, FAULT_TEMPERATURE);
}

static bool supply_implausible(void) {
    return reading_trips(HEALTH_SUPPLY, random_between(&rng, 0, 1) == 0 ? 2999 : 3601, FAULT_SUPPLY);
}

static bool stage_supply_implausible(void) {
    return reading_trips(HEALTH_HIGH_VOLTAGE, random_between(&rng, 0, 1) == 0 ? 0 : 170001, FAULT_HIGH_VOLTAGE);
}

/* Off, and then armed again, with something wrong: is it found before anything moves? */
static bool self_test_finds(uint32_t fault) {
    arm();
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint, (uint32_t)HIGH));
    bool rested = true;
    unsigned samples = 0;
    do {
        loop_master_heard();
        run(1);
        rested = rested && (last == PARK || !fake_board.stage_enabled);
    } while (++samples < 10100 && state() == AMPLIFIER_PRECHARGE);
    const bool found =
        state() == AMPLIFIER_FAULT && !fake_board.stage_enabled && 1U << (master_get(INDEX_trip_cause) - 1U) == fault;
    master_command(COMMAND_STOP);
    run(3);
    return rested && found && state() == AMPLIFIER_OFF;
}

static void disarm(void) {
    master_command(COMMAND_DISARM);
    loop_master_heard();
    run(9000);
    TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_OFF, state());
}

static bool stage_does_not_come_up(void) {
    disarm();
    fake_board.health[HEALTH_HIGH_VOLTAGE] = random_between(&rng, 0, 1) == 0 ? 149999 : 170001;
    run(HEALTH_WATCH_TURN);
    const bool found = self_test_finds(FAULT_HIGH_VOLTAGE);
    fake_board.health[HEALTH_HIGH_VOLTAGE] = FAKE_HIGH_VOLTAGE;
    return found;
}

/* Any one bit of the coefficients. Out of it by another commit, and by nothing else. */
static bool image_changes_in_memory(void) {
    disarm();
    char *bytes = (char *)&loop.active->compensator.drive_park;
    const int32_t length = (int32_t)(sizeof loop.active->compensator - offsetof(hyst_compensator_t, drive_park));
    char *at = bytes + random_between(&rng, 0, length - 1);
    const char bit = (char)(1U << random_between(&rng, 0, 7));
    *at = (char)(*at ^ bit);
    const bool found = self_test_finds(FAULT_IMAGE);
    const bool again = self_test_finds(FAULT_IMAGE);
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    master_write_words(ADDRESS_staging, words, image(words, 2));
    master_command(COMMAND_COMMIT);
    loop_master_heard();
    run(3000);
    arm();
    loop_master_heard();
    run(1100);
    return found && again && state() == AMPLIFIER_HOLD && (master_get(INDEX_limits_live) & LIMIT_MEMORY) == 0;
}

/* A number of it while it moves: the main loop goes through all of them. Not a count or a pointer, which would lead the
 * loop of this program out of its memory; on a board that is a processor fault. */
static bool image_changes_in_use(void) {
    enum { TURNS = 2 * (sizeof(loop_parameters_t) / 60 + 5) }; /* two passes, in portions of 60 bytes */
    char *bytes = (char *)&loop.active->compensator;
    const int32_t first = (int32_t)offsetof(hyst_compensator_t, drive_park);
    char *at = bytes + random_between(&rng, first, (int32_t)offsetof(hyst_compensator_t, shape) - 1);
    const hyst_compensator_t before = loop.active->compensator;
    for (unsigned turn = 0; turn < TURNS && state() != AMPLIFIER_FAULT; turn++) {
        if (turn == 20) { /* half way through */
            *at = (char)(*at ^ (char)(1U << random_between(&rng, 0, 7)));
        }
        loop_master_heard();
        (void)amplifier_serve();
        run(PARAMETER_STORE_CHECK_US / FAKE_SAMPLE_US);
    }
    loop.active->compensator = before; /* what it does with other numbers is of no interest here */
    return state() == AMPLIFIER_FAULT && parked_by(FAULT_IMAGE);
}

/* Answers nothing, and starts nothing. */
static bool main_loop_stands_still(void) {
    fake_board.main_stalls = true;
    for (unsigned i = 0; i < 5000; i++) {
        loop_master_heard(); /* before it stood still */
        run(1);
    }
    fake_board.main_stalls = false;
    return parked_by(FAULT_STALL);
}

static bool warm(void) {
    loop_master_heard();
    const uint32_t before = state();
    fake_board.health[HEALTH_TEMPERATURE] = random_between(&rng, 0, 1) == 0 ? 70001 : -100000;
    run((HEALTH_WATCH_LOOKS + 1U) * HEALTH_WATCH_TURN);
    const uint32_t now = state();
    return (master_get(INDEX_warnings_live) & WARNING_TEMPERATURE) != 0 && now != AMPLIFIER_FAULT &&
           (now == before || now == AMPLIFIER_HOLD);
}

/* Half the range of the image, from wherever the drive is. */
static bool range_narrowed(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_drive_low, (uint32_t)(PARK - SLEW)));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_drive_high, 0));
    loop_master_heard();
    run(1000);
    bool held = true;
    for (unsigned i = 0; i < 2000; i++) {
        loop_master_heard();
        run(1);
        held = held && last >= PARK - SLEW - CODE_STEP && last <= CODE_STEP;
    }
    return held && state() != AMPLIFIER_FAULT;
}

static const struct {
    const char *fault, *expected;
    bool (*happens)(void);
    bool restarts; /* the drive begins anew: the step there is the stage's, which is off */
} faults[] = {
    {"host dies or its line is cut", "ramp to park after the communication timeout; out only by stop", host_dies,
     false},
    {"loop overloaded", "ramp to park in the 5th late sample, without the compensator; out only by stop",
     clock_too_slow, false},
    {"single late samples", "counted, no reaction", single_late_samples, false},
    {"supply sags", "ramp to park in the same sample; out only by stop", supply_sags, false},
    {"images with other parking drives are committed in a fault",
     "ramp to the last one's; the stage goes off where the output rests first, and stays off", other_images_in_a_fault,
     false},
    {"position converter stuck", "reported, no reaction: nothing is controlled by the position", converter_stuck,
     false},
    {"average current above its limit", "ramp to park in the sample that exceeds it; out only by stop",
     current_too_high, false},
    {"too hot", "ramp to park after the debounce count; out only by stop", too_hot, false},
    {"supply outside of its limits", "the same", supply_implausible, false},
    {"supply of the stage outside of its limits, while it is up", "the same", stage_supply_implausible, false},
    {"supply of the stage does not come up", "stage off a second after arming, drive still parked; out only by stop",
     stage_does_not_come_up, false},
    {"image in force changes in memory", "stage not enabled when it is armed; out only by another commit",
     image_changes_in_memory, false},
    {"image in force changes in memory while it runs",
     "found within half a second, also beside answers without a pause; ramp to park without the compensator; out only "
     "by another commit",
     image_changes_in_use, false},
    {"main loop stands still", "ramp to park after 0.4 s, the stage off there; then the hardware watchdog restarts",
     main_loop_stands_still, false},
    {"warm, or the temperature sensor lost", "warning after the debounce count; nothing stops", warm, false},
    {"output range narrowed under motion", "ramp into it, and nothing leaves it", range_narrowed, false},
    {"sensor lost", "warning after 0.1 s at an end of the converter; nothing stops", sensor_lost, false},
    {"reading stands still", "warning once the drive has gone a quarter of its range; nothing stops",
     reading_stands_still, false},
    {"reference jumps", "no step beyond what the board allows", reference_jumps, false},
    {"parameter image damaged", "refused, the one before stays in force", image_broken, false},
    {"bit flipped on the line", "request dropped, nothing changed, no answer", line_flips_bits, false},
    {"supply goes while an image is stored", "the image before or the new one, whole; start off and parked",
     supply_goes_while_storing, true},
    {"processor restarts under motion", "off, stage disabled, nothing moves until an image and arming",
     restart_under_motion, true},
};
enum { FAULTS = sizeof faults / sizeof faults[0] };

/* One row each: of a fault in lives that have no other, and of a rule in lives that have them all. */
typedef struct {
    const char *fault, *expected;
    unsigned long held, lives;
} row_t;

enum { ROWS = FAULTS + RULES, LIVES_EACH = 2 };

static row_t row_of_fault(unsigned f, unsigned long lives) {
    row_t row = {.fault = faults[f].fault, .expected = faults[f].expected, .lives = lives};
    for (unsigned long i = 0; i < lives; i++) {
        live();
        const bool before = lawful;
        const bool good = faults[f].happens();
        row.held += good && (faults[f].restarts ? before : lawful) ? 1UL : 0UL;
    }
    return row;
}

static void write_rows(const row_t rows[ROWS]) {
    FILE *file = fopen(FAULTS_JSON, "w");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, FAULTS_JSON);
    (void)fprintf(file, "[\n");
    for (unsigned r = 0; r < ROWS; r++) {
        (void)fprintf(file,
                      "  {\"fault\": \"%s\", \"expected\": \"%s\", \"seen\": \"as expected in %lu of %lu lives\", "
                      "\"held\": %s, \"seed\": \"%" PRIu64 "\", \"commit\": \"%s\"}%s\n",
                      rows[r].fault, rows[r].expected, rows[r].held, rows[r].lives,
                      rows[r].held == rows[r].lives ? "true" : "false", seed, built_from, r + 1U < ROWS ? "," : "");
    }
    (void)fprintf(file, "]\n");
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static void test_every_fault(void) {
    const char *wanted = getenv("HYST_FAULT_RUNS");
    const unsigned long runs = wanted != NULL ? strtoul(wanted, NULL, 10) : 100UL;
    row_t rows[ROWS];
    for (unsigned f = 0; f < FAULTS; f++) {
        rows[f] = row_of_fault(f, runs);
    }
    const lives_t lives = lives_run(seed, LIVES_EACH * runs);
    for (unsigned rule = 0; rule < RULES; rule++) {
        rows[FAULTS + rule] = (row_t){.fault = rule_text[rule].fault,
                                      .expected = rule_text[rule].expected,
                                      .held = lives.held[rule],
                                      .lives = lives.lives};
    }
    write_rows(rows);
    for (unsigned r = 0; r < ROWS; r++) {
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(rows[r].lives, rows[r].held, rows[r].fault);
    }
}

static void expect_row(const char *page, const char *fault, const char *expected) {
    char row[300];
    (void)snprintf(row, sizeof row, "\n| %s | %s | as expected in ", fault, expected);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(page, row), fault);
}

/* docs/FAULTS.md has each of them, with what is expected. */
static void test_the_page_has_every_fault(void) {
    static char page[1 << 16];
    FILE *file = fopen(FAULTS_PAGE, "r");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, FAULTS_PAGE);
    page[fread(page, 1, sizeof page - 1, file)] = '\0';
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
    for (unsigned f = 0; f < FAULTS; f++) {
        expect_row(page, faults[f].fault, faults[f].expected);
    }
    for (unsigned rule = 0; rule < RULES; rule++) {
        expect_row(page, rule_text[rule].fault, rule_text[rule].expected);
    }
}

int main(void) {
    rng = random_start("firmware_faults", 20261123);
    seed = rng.state;
    printf("built from commit %s\n", built_from);
    UNITY_BEGIN();
    RUN_TEST(test_every_fault);
    RUN_TEST(test_the_page_has_every_fault);
    return UNITY_END();
}
