/* SPDX-License-Identifier: MIT */
/*
 * The supply goes while an image with its limits or the settings of the line are being stored: after every program and
 * every erase step, within each of them, and again while the start after that stores anew. What the amplifier then
 * finds is exactly what was there before or exactly what was being stored, and always one of them.
 *
 * The flash of fake_board.c: an erase that is cut leaves any word erased, untouched or torn; a word that is being
 * programmed when the cut comes has lost any of the bits it was to lose.
 */
#include "built_from.h"
#include "fake_board.h"
#include "hyst/parameters.h"
#include "loop/loop.h"
#include "master.h"
#include "protection/health_watch.h"
#include "random.h"
#include "store/image_store.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <stdio.h>
#include <string.h>

/* Words of a copy before its limits and its image. */
enum { HEADER = 7 };

static random_t rng;

static uint32_t any_bits(void) {
    return (uint32_t)random_bits(&rng);
}

void setUp(void) {
    fake_store_clear();
}
void tearDown(void) {
}

typedef struct {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    size_t length;
} image_t;

static image_t random_image(size_t most) {
    image_t image = {.length = (size_t)random_between(&rng, 1, (int32_t)most)};
    for (size_t i = 0; i < image.length; i++) {
        image.words[i] = random_between(&rng, 0, 3) == 0 ? UINT32_MAX : (uint32_t)random_bits(&rng);
    }
    return image;
}

static bool stored(const image_t *image) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t length = image_store_load(words, HYST_IMAGE_MAX_WORDS);
    return length == image->length && memcmp(words, image->words, length * sizeof words[0]) == 0;
}

static void test_what_is_saved_is_loaded(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, image_store_load(words, HYST_IMAGE_MAX_WORDS), "an erased flash");
    for (unsigned i = 0; i < 100; i++) {
        const image_t image = random_image(HYST_IMAGE_MAX_WORDS);
        TEST_ASSERT_TRUE(image_store_save(image.words, image.length, NULL, 0));
        TEST_ASSERT_TRUE(stored(&image));
        TEST_ASSERT_EQUAL_UINT32(i + 1U, image_store_sequence());
    }
    TEST_ASSERT_EQUAL_UINT_MESSAGE(100, fake_store.erasures, "one erasure a save");
}

/* Every step of a save of small and large images, with the cut in it, from both sectors. */
static void test_a_cut_after_every_step(void) {
    unsigned cuts = 0, kept = 0, renewed = 0;
    image_t old = random_image(40);
    TEST_ASSERT_TRUE(image_store_save(old.words, old.length, NULL, 0));
    for (unsigned run = 0; run < 400; run++) {
        const image_t next = random_image(run % 50 == 0 ? HYST_IMAGE_MAX_WORDS : 40);
        for (unsigned step = 0;; step++) {
            const fake_store_t before = fake_store;
            fake_store_cut_after(step, any_bits);
            const bool done = image_store_save(next.words, next.length, NULL, 0);
            const bool cut = fake_store_power_on();
            cuts += cut ? 1U : 0U;
            const bool is_old = stored(&old), is_new = stored(&next);
            TEST_ASSERT_TRUE_MESSAGE(is_old || is_new, "neither the old nor the new image");
            TEST_ASSERT_TRUE_MESSAGE(!done || is_new, "said to be stored, and is not");
            kept += is_old ? 1U : 0U;
            renewed += is_new ? 1U : 0U;
            if (!cut) {
                old = next;
                break;
            }
            if (random_between(&rng, 0, 3) != 0) {
                fake_store = before; /* the next step from the same past; else go on with what the cut left behind */
            } else if (is_new) {
                old = next;
            }
        }
    }
    (void)printf("%u cuts: %u times the old image, %u times the new one\n", cuts, kept, renewed);
    TEST_ASSERT_GREATER_THAN_UINT(10000, cuts);
    TEST_ASSERT_GREATER_THAN_UINT(100, renewed);
}

/* Cut upon cut: each start tries to store, and is cut, many times in a row. */
static void test_a_row_of_cuts(void) {
    image_t last = random_image(60);
    TEST_ASSERT_TRUE(image_store_save(last.words, last.length, NULL, 0));
    for (unsigned run = 0; run < 20000; run++) {
        const image_t next = random_image(60);
        fake_store_cut_after((unsigned)random_between(&rng, 0, 80), any_bits);
        (void)image_store_save(next.words, next.length, NULL, 0);
        (void)fake_store_power_on();
        const bool is_new = stored(&next);
        TEST_ASSERT_TRUE(is_new || stored(&last));
        if (is_new) {
            last = next;
        }
    }
}

/* An image, or none, its limits, and the settings of the line beside it. */
typedef struct {
    image_t image;
    stored_limit_t limits[IMAGE_STORE_LIMITS_MAX];
    size_t limit_count;
    line_settings_t line;
} copy_t;

static void random_limits(copy_t *copy) {
    copy->limit_count = (size_t)random_between(&rng, 0, IMAGE_STORE_LIMITS_MAX);
    for (size_t i = 0; i < copy->limit_count; i++) {
        copy->limits[i] = (stored_limit_t){.address = any_bits() & 0xFFFFU, .value = any_bits()};
    }
}

static line_settings_t random_line(void) {
    static const uint32_t rates[] = {9600, 19200, 38400, 57600, 115200, 230400};
    return (line_settings_t){.address = (uint32_t)random_between(&rng, 1, LINE_ADDRESS_MAX),
                             .baud = rates[random_between(&rng, 0, 5)],
                             .parity = (uint32_t)random_between(&rng, LINE_PARITY_NONE, LINE_PARITY_ODD)};
}

static bool stored_copy(const copy_t *copy) {
    const line_settings_t line = image_store_line();
    stored_limit_t limits[IMAGE_STORE_LIMITS_MAX];
    const size_t count = image_store_limits(limits);
    return stored(&copy->image) && count == copy->limit_count &&
           memcmp(limits, copy->limits, count * sizeof limits[0]) == 0 && line.address == copy->line.address &&
           line.baud == copy->line.baud && line.parity == copy->line.parity;
}

/* Saves of images and of lines in any order, from an erased flash on: the one never touches the other. */
static void test_a_cut_while_image_or_line_is_saved(void) {
    unsigned cuts = 0, lines = 0, renewed = 0;
    copy_t last = {.image = {.length = 0}, .line = LINE_SETTINGS_DEFAULT};
    TEST_ASSERT_TRUE(stored_copy(&last));
    for (unsigned run = 0; run < 300; run++) {
        const bool is_line = random_between(&rng, 0, 1) != 0;
        copy_t next = last;
        if (is_line) {
            next.line = random_line();
        } else {
            next.image = random_image(40);
            random_limits(&next);
        }
        for (unsigned step = 0;; step++) {
            const fake_store_t before = fake_store;
            fake_store_cut_after(step, any_bits);
            const bool done =
                is_line ? image_store_save_line(&next.line)
                        : image_store_save(next.image.words, next.image.length, next.limits, next.limit_count);
            const bool cut = fake_store_power_on();
            const bool is_new = stored_copy(&next);
            TEST_ASSERT_TRUE_MESSAGE(is_new || stored_copy(&last), "neither the old nor the new copy");
            TEST_ASSERT_TRUE_MESSAGE(!done || is_new, "said to be stored, and is not");
            cuts += cut ? 1U : 0U;
            renewed += cut && is_new ? 1U : 0U;
            lines += cut && is_line ? 1U : 0U;
            if (!cut) {
                last = next;
                break;
            }
            if (is_new || random_between(&rng, 0, 3) != 0) {
                fake_store = before;
            }
        }
    }
    (void)printf("%u cuts, %u of them in the line's; %u times the new copy\n", cuts, lines, renewed);
    TEST_ASSERT_GREATER_THAN_UINT(5000, cuts);
    TEST_ASSERT_GREATER_THAN_UINT(2000, lines);
}

/* What a firmware stored that knew no settings of the line (layout 1), or no limits (2). */
static void test_a_copy_of_a_layout_before_is_read(void) {
    for (uint32_t layout = 1; layout <= 2; layout++) {
        const image_t image = random_image(40);
        copy_t copy = {.image = image, .line = LINE_SETTINGS_DEFAULT};
        uint32_t *sector = fake_store.words[1];
        fake_store_clear();
        sector[0] = 0x48595053;
        sector[1] = layout;
        sector[2] = 7;
        sector[3] = (uint32_t)image.length;
        size_t at = 4;
        if (layout == 2) {
            copy.line = random_line();
            sector[at++] = copy.line.address | copy.line.parity << 8;
            sector[at++] = copy.line.baud;
        }
        memcpy(sector + at, image.words, image.length * sizeof image.words[0]);
        at += image.length;
        sector[at] = hyst_crc32(sector, at);
        TEST_ASSERT_TRUE(stored_copy(&copy));
        TEST_ASSERT_EQUAL_UINT32(7, image_store_sequence());
        copy.line = (line_settings_t){.address = 9, .baud = 19200, .parity = LINE_PARITY_EVEN};
        TEST_ASSERT_TRUE(image_store_save_line(&copy.line));
        TEST_ASSERT_TRUE_MESSAGE(stored_copy(&copy), "the image of the old copy goes along");
        TEST_ASSERT_EQUAL_UINT32(8, image_store_sequence());
    }
}

static void test_a_flash_that_does_not_take_a_word_is_noticed(void) {
    const image_t old = random_image(40);
    image_t next = random_image(40);
    for (size_t i = 0; i < next.length; i++) {
        next.words[i] &= 0x7FFFFFFFU; /* all ones need no programming */
    }
    TEST_ASSERT_TRUE(image_store_save(old.words, old.length, NULL, 0));
    for (size_t word = 0; word <= HEADER + next.length; word++) {
        fake_store.stuck_word = word;
        fake_store.stuck = true;
        TEST_ASSERT_FALSE(image_store_save(next.words, next.length, NULL, 0));
        fake_store.stuck = false;
        TEST_ASSERT_TRUE(stored(&old));
    }
}

static void test_the_sequence_may_wrap(void) {
    image_t image = random_image(10);
    TEST_ASSERT_TRUE(image_store_save(image.words, image.length, NULL, 0));
    uint32_t *sector = fake_store.words[0];
    sector[2] = UINT32_MAX;
    sector[HEADER + image.length] = hyst_crc32(sector, HEADER + image.length);
    for (unsigned i = 0; i < 4; i++) {
        image = random_image(10);
        TEST_ASSERT_TRUE(image_store_save(image.words, image.length, NULL, 0));
        TEST_ASSERT_TRUE(stored(&image));
    }
}

static size_t parked_at(hyst_q31_t park, uint32_t words[HYST_IMAGE_MAX_WORDS]) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.drive_park = park;
    p.model_id = 77;
    return hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS);
}

/* Through the registers: saved only when off, in force after the next start, parked there from the first sample on. */
static void test_the_amplifier_starts_with_what_was_saved(void) {
    enum { PARK = 1 << 29 };
    const board_start_t start = {.reset_cause = RESET_POWER};
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t length = parked_at(PARK, words);
    fake_board_start(&start);
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_SAVE)); /* there is nothing to save */
    master_write_words(ADDRESS_staging, words, length);
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_SAVE), "not yet in force");
    TEST_ASSERT_NOT_EQUAL(PARK, fake_board_run(10));
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_SAVE), "not while it moves");
    (void)fake_board_run(3000);
    master_command(COMMAND_ARM);
    (void)fake_board_run(3000);
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_SAVE), "not while armed");
    master_command(COMMAND_DISARM);
    (void)fake_board_run(10);
    master_command(COMMAND_SAVE);
    TEST_ASSERT_EQUAL_UINT32(STORE_SAVED, master_get(INDEX_store_state));

    fake_board_start(&start);
    TEST_ASSERT_EQUAL_INT32(PARK, fake_board_run(1));
    TEST_ASSERT_EQUAL_UINT32(77, master_get(INDEX_active_model_id));
    TEST_ASSERT_EQUAL_UINT32(STORE_LOADED, master_get(INDEX_store_state));
    master_command(COMMAND_ARM); /* there are limits */

    /* An image that this firmware refuses, in a whole copy: as if there were none. */
    words[14] = 1; /* a transition that never arrives */
    words[length - 1] = hyst_crc32(words, length - 1);
    TEST_ASSERT_TRUE(image_store_save(words, length, NULL, 0));
    fake_board_start(&start);
    TEST_ASSERT_EQUAL_HEX16(FAKE_SAFE_CODE, fake_board_sample(0));
    TEST_ASSERT_EQUAL_UINT32(STORE_REFUSED, master_get(INDEX_store_state));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
}

/* Off, with this image in force. */
static void commit(const uint32_t *words, size_t length) {
    master_write_words(ADDRESS_staging, words, length);
    master_command(COMMAND_COMMIT);
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_OK, master_get(INDEX_fault_code));
    (void)fake_board_run(3000);
}

/* What a lab sets once for its stack. */
static const struct {
    unsigned index;
    uint32_t value;
} limits[] = {{INDEX_setpoint_slew, 4321},
              {INDEX_model_error_limit, 1 << 20},
              {INDEX_model_error_time, 700},
              {INDEX_current_limit, 1 << 22},
              {INDEX_drive_low, (uint32_t) - (1 << 28)},
              {INDEX_drive_high, 1 << 29},
              {INDEX_reference_low, (uint32_t) - (1 << 27)},
              {INDEX_reference_high, 1 << 27},
              {INDEX_reference_slew, 1 << 18},
              {INDEX_temperature_alert, 60000},
              {INDEX_temperature_trip, 65000},
              {INDEX_supply_low, 3100},
              {INDEX_supply_high, 3500},
              {INDEX_high_voltage_low, 155000},
              {INDEX_high_voltage_high, 165000},
              {INDEX_health_looks, 3},
              {INDEX_capacitance, 3300000},
              {INDEX_drive_slew, FAKE_DRIVE_SLEW_MAX / 3}};
enum { LIMITS = sizeof limits / sizeof limits[0] };

static void set_limits(void) {
    for (size_t i = 0; i < LIMITS; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(limits[i].index, limits[i].value),
                                  register_table[limits[i].index].name);
    }
}

/* They are read back, and in force: the whole range cannot be swept any more, nor by conditioning. */
static void test_limits_survive_a_reset_with_their_image(void) {
    const board_start_t start = {.reset_cause = RESET_PIN};
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    fake_board_start(&start);
    commit(words, parked_at(0, words));
    set_limits();
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_watchdog, 0));
    master_command(COMMAND_SAVE);
    TEST_ASSERT_EQUAL_UINT32(STORE_SAVED, master_get(INDEX_store_state));

    fake_board_start(&start);
    for (size_t i = 0; i < LIMITS; i++) {
        TEST_ASSERT_EQUAL_HEX32_MESSAGE(limits[i].value, master_get(limits[i].index),
                                        register_table[limits[i].index].name);
    }
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(LOOP_DEFAULT_TIMEOUT_MS, master_get(INDEX_watchdog), "on at every start");
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_watchdog, 0));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_current_limit, 0)); /* conditioning may take what it takes */
    master_command(COMMAND_ARM);
    (void)fake_board_run(1100);
    master_command(COMMAND_CONDITION);
    hyst_q31_t low = 0, high = 0;
    for (unsigned i = 0; i < 30000 && loop_conditioning(); i++) {
        const hyst_q31_t drive = fake_board_run(1);
        low = drive < low ? drive : low;
        high = drive > high ? drive : high;
    }
    TEST_ASSERT_FALSE(loop_conditioning());
    TEST_ASSERT_EQUAL_INT32(-(1 << 28), low);
    TEST_ASSERT_EQUAL_INT32(1 << 29, high);
    fake_board.health[HEALTH_SUPPLY] = 3050; /* within the board's limits */
    (void)fake_board_run(4U * HEALTH_WATCH_TURN);
    TEST_ASSERT_TRUE(loop_in_fault());
}

/* A save of the line takes them along; a commit without a save does not change what is stored. */
static void test_limits_stay_with_what_is_stored(void) {
    const board_start_t start = {.reset_cause = RESET_PIN};
    const line_settings_t line = {.address = 9, .baud = 19200, .parity = LINE_PARITY_EVEN};
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    fake_board_start(&start);
    commit(words, parked_at(0, words));
    set_limits();
    master_command(COMMAND_SAVE);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_drive_high, 1 << 30));
    TEST_ASSERT_TRUE(image_store_save_line(&line));
    fake_board_start(&start);
    TEST_ASSERT_EQUAL_UINT32(1 << 29, master_get(INDEX_drive_high));
}

/* Limits that this firmware does not have, or that exclude the parking drive: it parks there, and cannot be armed
 * before somebody commits an image. */
static void test_limits_that_cannot_be_in_force_keep_the_amplifier_disarmed(void) {
    static const stored_limit_t bad[][2] = {{{ADDRESS_drive_high, 1 << 29}, {0x7777, 1}},
                                            {{ADDRESS_drive_high, 0}, {ADDRESS_setpoint_slew, 5}},
                                            {{ADDRESS_setpoint_slew, 0}, {ADDRESS_current_limit, 5}}};
    const board_start_t start = {.reset_cause = RESET_POWER};
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t length = parked_at(1 << 28, words);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_TRUE(image_store_save(words, length, bad[i], 2));
        fake_board_start(&start);
        TEST_ASSERT_EQUAL_UINT32(STORE_REFUSED, master_get(INDEX_store_state));
        TEST_ASSERT_EQUAL_INT32(1 << 28, fake_board_run(1));
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
        TEST_ASSERT_EQUAL_HEX32_MESSAGE(HYST_Q31_MAX, master_get(INDEX_drive_high), "all or none");
        commit(words, length);
        master_command(COMMAND_ARM);
    }
}

int main(void) {
    rng = random_start("firmware_power_loss", 20261123);
    printf("built from commit %s\n", built_from);
    UNITY_BEGIN();
    RUN_TEST(test_what_is_saved_is_loaded);
    RUN_TEST(test_a_cut_after_every_step);
    RUN_TEST(test_a_row_of_cuts);
    RUN_TEST(test_a_cut_while_image_or_line_is_saved);
    RUN_TEST(test_a_copy_of_a_layout_before_is_read);
    RUN_TEST(test_a_flash_that_does_not_take_a_word_is_noticed);
    RUN_TEST(test_the_sequence_may_wrap);
    RUN_TEST(test_the_amplifier_starts_with_what_was_saved);
    RUN_TEST(test_limits_survive_a_reset_with_their_image);
    RUN_TEST(test_limits_stay_with_what_is_stored);
    RUN_TEST(test_limits_that_cannot_be_in_force_keep_the_amplifier_disarmed);
    return UNITY_END();
}
