/* SPDX-License-Identifier: MIT */
/* Parameter upload: a broken one changes nothing, a good one acts at a sample boundary and without a bump. */
#include "fake_board.h"
#include "loop/loop.h"
#include "master.h"
#include "models.h"
#include "random.h"
#include "store/parameter_store.h"
#include "unity.h"
#include <string.h>

static random_t rng;

void setUp(void) {
    fake_board_power_on(0);
}
void tearDown(void) {
}

static hyst_parameters_t random_parameters(uint32_t operators) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    const pi_arguments_t a = pi_random(&rng, operators, false);
    p.model_id = (uint32_t)random_bits(&rng);
    p.pi_operators = operators;
    p.hysteresis_offset = a.offset;
    memcpy(p.pi_weight, a.weight, sizeof p.pi_weight);
    memcpy(p.pi_threshold, a.threshold, sizeof p.pi_threshold);
    p.linear_gain = random_between(&rng, HYST_Q28_ONE / 4, 2 * HYST_Q28_ONE);
    return p;
}

static size_t encode(const hyst_parameters_t *p, uint32_t words[HYST_IMAGE_MAX_WORDS]) {
    const size_t length = hyst_parameters_encode(p, words, HYST_IMAGE_MAX_WORDS);
    TEST_ASSERT_NOT_EQUAL(0, length);
    return length;
}

static hyst_parameters_error_t upload(const uint32_t *words, size_t length) {
    master_write_words(ADDRESS_staging, words, length);
    master_command(COMMAND_COMMIT);
    return (hyst_parameters_error_t)master_get(INDEX_fault_code);
}

static void read_active(uint16_t registers[LENGTH_active]) {
    for (unsigned at = 0; at < LENGTH_active; at += 96) {
        const unsigned left = LENGTH_active - at;
        const uint16_t count = (uint16_t)(left < 96 ? left : 96);
        TEST_ASSERT_EQUAL(MODBUS_OK, master_read((uint16_t)(ADDRESS_active + at), count, registers + at));
    }
}

static void assert_active(const uint32_t *words, size_t length) {
    uint16_t active[LENGTH_active];
    read_active(active);
    TEST_ASSERT_EQUAL_UINT32(length, master_get(INDEX_active_words));
    for (size_t i = 0; i < LENGTH_active / 2U; i++) {
        const uint32_t word = (uint32_t)active[2U * i] << 16 | active[2U * i + 1U];
        TEST_ASSERT_EQUAL_HEX32(i < length ? words[i] : 0U, word);
    }
}

static void test_the_default_image_is_in_force_at_start(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_t p;
    const board_start_t start = {.reset_cause = RESET_POWER};
    fake_board_start(&start);
    hyst_parameters_default(&p);
    p.drive_park = HYST_Q31_MIN; /* the safe code, 0 */
    assert_active(words, encode(&p, words));
    TEST_ASSERT_EQUAL_UINT32(0, master_get(INDEX_commits));
}

static void test_a_good_image_is_accepted_and_can_be_read_back(void) {
    for (uint32_t operators = 0; operators <= HYST_PI_MAX_OPERATORS; operators += 32) {
        uint32_t words[HYST_IMAGE_MAX_WORDS];
        const hyst_parameters_t p = random_parameters(operators);
        const size_t length = encode(&p, words);
        TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, upload(words, length));
        TEST_ASSERT_EQUAL_UINT32(p.model_id, master_get(INDEX_active_model_id));
        TEST_ASSERT_EQUAL_UINT32(FAKE_COMMITS + operators / 32 + 1, master_get(INDEX_commits));
        assert_active(words, length);
        while (
            loop_adoption_pending()) { /* a few: with each swap the memory gets kinks where thresholds do not match */
            (void)fake_board_run(1);
        }
    }
}

static void play(unsigned samples, uint16_t codes[]) {
    for (unsigned i = 0; i < samples; i++) {
        codes[i] = fake_board_sample(0);
    }
}

static void start_sine(void) {
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_COMPENSATE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_SINE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_amplitude, 1U << 29));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, 1U << 26));
    master_command(COMMAND_START);
}

/* A model whose play operators really play: the sine's amplitude is 1/4. */
static hyst_parameters_t ten_operators(void) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.model_id = 1;
    p.pi_operators = 10;
    p.pi_weight[0] = HYST_Q28_ONE / 2;
    for (int32_t i = 0; i < 10; i++) {
        p.pi_threshold[i] = (i + 1) << 25;
        p.pi_weight[i + 1] = HYST_Q28_ONE / 20;
    }
    return p;
}

/* One bit wrong in one word, every word in turn: refused for the right reason, and the loop gives the same codes,
 * sample by sample, as without the upload. */
static void test_an_upload_broken_at_any_word_changes_nothing(void) {
    enum { SAMPLES = 300 };
    uint32_t first[HYST_IMAGE_MAX_WORDS], second[HYST_IMAGE_MAX_WORDS];
    const hyst_parameters_t p = ten_operators();
    const hyst_parameters_t q = random_parameters(10);
    const size_t length = encode(&p, first);
    TEST_ASSERT_EQUAL_UINT(length, encode(&q, second));

    uint16_t undisturbed[SAMPLES], disturbed[SAMPLES];
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, upload(first, length));
    start_sine();
    play(SAMPLES, undisturbed);

    for (size_t word = 0; word < length; word++) {
        fake_board_power_on(0);
        TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, upload(first, length));
        start_sine();
        play(SAMPLES / 2, disturbed);
        uint32_t broken[HYST_IMAGE_MAX_WORDS];
        memcpy(broken, second, sizeof broken);
        broken[word] ^= 1U << random_between(&rng, 0, 31);
        const hyst_parameters_error_t error = upload(broken, length);
        if (word > 2) {
            TEST_ASSERT_EQUAL(HYST_PARAMETERS_BAD_CRC, error);
            TEST_ASSERT_EQUAL_UINT32(HYST_FIELD_CRC, master_get(INDEX_fault_field));
        } else {
            static const hyst_parameters_error_t expected[] = {HYST_PARAMETERS_BAD_MAGIC, HYST_PARAMETERS_BAD_VERSION,
                                                               HYST_PARAMETERS_BAD_LENGTH};
            /* a length that is still possible but not this image's shows as a wrong CRC at the wrong place */
            TEST_ASSERT_TRUE(error == expected[word] || (word == 2 && error == HYST_PARAMETERS_BAD_CRC));
        }
        assert_active(first, length);
        TEST_ASSERT_EQUAL_UINT32(FAKE_COMMITS + 1, master_get(INDEX_commits));
        play(SAMPLES / 2, disturbed + SAMPLES / 2);
        TEST_ASSERT_EQUAL_HEX16_ARRAY(undisturbed, disturbed, SAMPLES);
    }
}

/* An upload that stops after any number of registers, with the commit coming nevertheless. */
static void test_an_upload_cut_short_is_refused(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const hyst_parameters_t p = random_parameters(3);
    const size_t length = encode(&p, words);
    for (size_t cut = 0; cut < length; cut++) {
        fake_board_power_on(0);
        TEST_ASSERT_NOT_EQUAL(HYST_PARAMETERS_OK, upload(words, cut));
        TEST_ASSERT_EQUAL_UINT32(FAKE_COMMITS, master_get(INDEX_commits));
    }
}

/* Right CRC, wrong contents: the validator's part, and where it points. */
static void test_an_image_that_the_validator_refuses(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_t p = random_parameters(4);
    p.pi_weight[2] = -4 * HYST_Q28_ONE;
    TEST_ASSERT_NOT_EQUAL(HYST_PARAMETERS_OK, upload(words, encode(&p, words)));
    TEST_ASSERT_EQUAL_UINT32(HYST_FIELD_PI_WEIGHT, master_get(INDEX_fault_field));
    TEST_ASSERT_EQUAL_UINT32(2, master_get(INDEX_fault_element));
    TEST_ASSERT_EQUAL_UINT32(FAKE_COMMITS, master_get(INDEX_commits));
}

static void test_an_image_for_another_sample_rate_is_refused(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_t p = random_parameters(4);
    p.sample_rate_mhz++;
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_INCONSISTENT, upload(words, encode(&p, words)));
    TEST_ASSERT_EQUAL_UINT32(HYST_FIELD_SAMPLE_RATE, master_get(INDEX_fault_field));
}

/* Without a sample in between the loop has not yet let go of the other half of the double buffer. */
static void test_a_second_commit_before_the_next_sample_is_refused(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const hyst_parameters_t p = random_parameters(4);
    const size_t length = encode(&p, words);
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, upload(words, length));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_COMMIT));
    (void)fake_board_run(1);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, COMMAND_COMMIT));
    TEST_ASSERT_EQUAL_UINT32(FAKE_COMMITS + 2, master_get(INDEX_commits));
}

/* As many runs of play operators as there can be: the samples share carrying them over, and nothing else notices. */
static void test_a_deep_memory_is_adopted_by_several_samples(void) {
    enum { OPERATORS = HYST_PI_MAX_OPERATORS };
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_t p = random_parameters(OPERATORS);
    const int64_t half = HYST_Q31_MAX / 2; /* the setpoint cannot go farther than 1 in a sample */
    for (int64_t i = 0; i < OPERATORS; i++) {
        p.pi_threshold[i] = (hyst_q31_t)(half * (i + 1) / (OPERATORS + 1));
    }
    p.transition_slew = FAKE_TRANSITION_SLEW_MAX;
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, upload(words, encode(&p, words)));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint_slew, (uint32_t)HYST_Q31_MAX));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    (void)fake_board_run(200);
    hyst_q31_t drive = 0;
    for (int64_t k = OPERATORS; k > 0; k--) { /* each reversal leaves one operator behind */
        const int64_t amplitude = half * (4 * k + 1) / (4 * OPERATORS + 4);
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint, (uint32_t)(k % 2 == 0 ? amplitude : -amplitude)));
        drive = fake_board_run(5); /* at most 1, by the board's slew of a quarter a sample */
    }
    p.model_id++;
    p.pi_weight[0] += 1000;
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, upload(words, encode(&p, words)));
    for (uint32_t sample = 0; sample < HYST_PI_CARRY_CALLS; sample++) {
        TEST_ASSERT_TRUE(loop_adoption_pending());
        TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_COMMIT));
        TEST_ASSERT_EQUAL_INT32(drive, fake_board_run(1));
    }
    TEST_ASSERT_FALSE(loop_adoption_pending());
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, COMMAND_COMMIT));
}

/*
 * Swaps between models with the same slopes but different thresholds, while a slow sine runs. No step of the drive may
 * exceed what the reference's motion and the transition can make together: the reference moves at most 2 pi
 * amplitude / period, times the steepest inverse slope, plus transition_slew. Both halves of the sum are exact bounds
 * for a constant model, and the swap's own sample repeats the drive.
 */
static void test_swaps_under_motion_do_not_bump(void) {
    enum { PERIOD = 4096, AMPLITUDE = 1 << 29, STEEPEST = 2, SLEW = 100000 };
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    hyst_parameters_t p = ten_operators();
    p.transition_slew = SLEW;
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, upload(words, encode(&p, words)));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_COMPENSATE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_SINE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_amplitude, AMPLITUDE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, (UINT64_C(1) << 32) / PERIOD));
    master_command(COMMAND_START);
    hyst_q31_t last = fake_board_run(PERIOD);
    const double motion = 6.2832 * AMPLITUDE / PERIOD * STEEPEST;
    const double bound = motion + SLEW + 2.0 * 65536.0; /* and the rounding of two codes */
    double largest = 0.0;
    for (int i = 0; i < 3 * PERIOD; i++) {
        if (i % 517 == 0) {
            for (int32_t k = 0; k < 10; k++) {
                p.pi_threshold[k] = ((k + 1) << 25) + random_between(&rng, -(1 << 23), 1 << 23);
            }
            p.hysteresis_offset = random_between(&rng, -(1 << 26), 1 << 26);
            TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, upload(words, encode(&p, words)));
            /* Few samples share it: a sine with its transitions leaves few runs. */
            hyst_q31_t before = last;
            for (int shared = 0; loop_adoption_pending(); shared++) {
                TEST_ASSERT_TRUE(shared < 12);
                before = last;
                last = fake_board_run(1);
            }
            TEST_ASSERT_EQUAL_INT32_MESSAGE(before, last, "the sample of the swap repeats the drive");
        }
        const hyst_q31_t drive = fake_board_run(1);
        const double step = drive > last ? (double)drive - last : (double)last - drive;
        largest = step > largest ? step : largest;
        TEST_ASSERT_TRUE(step <= bound);
        last = drive;
    }
    TEST_ASSERT_TRUE_MESSAGE(largest > motion / 4.0, "the drive must really have moved");
}

int main(void) {
    rng = random_start("firmware_upload", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_the_default_image_is_in_force_at_start);
    RUN_TEST(test_a_good_image_is_accepted_and_can_be_read_back);
    RUN_TEST(test_an_upload_broken_at_any_word_changes_nothing);
    RUN_TEST(test_an_upload_cut_short_is_refused);
    RUN_TEST(test_an_image_that_the_validator_refuses);
    RUN_TEST(test_an_image_for_another_sample_rate_is_refused);
    RUN_TEST(test_a_second_commit_before_the_next_sample_is_refused);
    RUN_TEST(test_a_deep_memory_is_adopted_by_several_samples);
    RUN_TEST(test_swaps_under_motion_do_not_bump);
    return UNITY_END();
}
