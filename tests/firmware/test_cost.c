/* SPDX-License-Identifier: MIT */
/*
 * What an image costs against what the processor's clock leaves of a period: at a commit, at start, and for the tones
 * of a source; and the samples that adopt an image, which may come late.
 */
#include "fake_board.h"
#include "hyst/cost.h"
#include "loop/loop.h"
#include "master.h"
#include "store/image_store.h"
#include "store/parameter_store.h"
#include "unity.h"

enum { FAST_HZ = 168000000 };

void setUp(void) {
    fake_core_hz = FAST_HZ;
    fake_board_power_on(0);
}
void tearDown(void) {
    fake_core_hz = FAST_HZ;
}

/* Plays at equal distances up to half the range. */
static hyst_parameters_t plays(uint32_t operators) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.model_id = operators;
    p.pi_operators = operators;
    p.pi_weight[0] = HYST_Q28_ONE / 2;
    for (uint32_t i = 0; i < operators; i++) {
        p.pi_threshold[i] = (hyst_q31_t)((int64_t)(HYST_Q31_MAX / 2) * (i + 1U) / (operators + 1U));
        p.pi_weight[i + 1U] = (hyst_q28_t)(HYST_Q28_ONE / 2 / (int32_t)operators);
    }
    return p;
}

static hyst_parameters_error_t commit(const hyst_parameters_t *p) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t length = hyst_parameters_encode(p, words, HYST_IMAGE_MAX_WORDS);
    master_write_words(ADDRESS_staging, words, length);
    master_command(COMMAND_COMMIT);
    return (hyst_parameters_error_t)master_get(INDEX_fault_code);
}

/* A sample fits a period, and a byte of the line as delivered. */
static uint32_t budget(uint32_t core_hz) {
    const line_settings_t line = LINE_SETTINGS_DEFAULT;
    const uint32_t period = hyst_cost_budget(core_hz, board_info.sample_rate_mhz);
    const uint32_t byte = line_sample_budget(core_hz, line.baud);
    return byte < period ? byte : period;
}

static void start_at(uint32_t core_hz) {
    const board_start_t start = {.reset_cause = RESET_POWER};
    fake_core_hz = core_hz;
    fake_board_start(&start);
}

/* From a clock that is too slow for any image to one that is fast enough for all: accepted exactly where it fits. */
static void test_an_image_is_accepted_where_its_worst_sample_fits_the_period(void) {
    static const uint32_t sizes[] = {0, 10, 64, 256};
    unsigned accepted = 0, refused = 0;
    for (uint32_t core_hz = 16000000; core_hz <= 36000000; core_hz += 250000) {
        for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
            fake_store_clear();
            start_at(core_hz);
            const hyst_parameters_t p = plays(sizes[i]);
            const bool fits = hyst_cost_cycles(&p) <= budget(core_hz);
            TEST_ASSERT_EQUAL(fits ? HYST_PARAMETERS_OK : HYST_PARAMETERS_TOO_COSTLY, commit(&p));
            TEST_ASSERT_EQUAL_UINT32(fits ? HYST_FIELD_NONE : HYST_FIELD_SAMPLE_RATE, master_get(INDEX_fault_field));
            TEST_ASSERT_EQUAL_UINT32(hyst_cost_cycles(&p), master_get(INDEX_image_cost));
            TEST_ASSERT_EQUAL_UINT32(budget(core_hz), master_get(INDEX_cost_budget));
            TEST_ASSERT_EQUAL_UINT32(fits ? 1 : 0, master_get(INDEX_commits));
            TEST_ASSERT_EQUAL_UINT32(fits ? p.model_id : 0, master_get(INDEX_active_model_id));
            TEST_ASSERT_EQUAL(fits ? MODBUS_OK : MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
            accepted += fits ? 1U : 0U;
            refused += fits ? 0U : 1U;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(50, accepted);
    TEST_ASSERT_GREATER_THAN_UINT(50, refused);
}

/* The clock has fallen back since the image was saved. */
static void test_a_stored_image_that_no_longer_fits_is_not_started_with(void) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const hyst_parameters_t p = plays(64);
    TEST_ASSERT_TRUE(image_store_save(words, hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS), NULL, 0));
    start_at(FAST_HZ);
    TEST_ASSERT_EQUAL_UINT32(STORE_LOADED, master_get(INDEX_store_state));
    start_at(16000000);
    TEST_ASSERT_EQUAL_UINT32(STORE_REFUSED, master_get(INDEX_store_state));
    TEST_ASSERT_EQUAL_UINT32(HYST_PARAMETERS_TOO_COSTLY, master_get(INDEX_fault_code));
    TEST_ASSERT_EQUAL_HEX16(FAKE_SAFE_CODE, fake_board_sample(0));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_ARM));
    start_at(FAST_HZ);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(STORE_LOADED, master_get(INDEX_store_state), "it is still there");
}

/* Tones cost beside the image in force, not beside one that was refused in the meantime. */
static void test_a_multisine_is_refused_with_more_tones_than_there_is_time_for(void) {
    enum { ROOM = 5 };
    const hyst_parameters_t small = plays(10);
    hyst_parameters_t large = plays(256);
    large.shape_sections = HYST_IIR_MAX_SECTIONS;
    for (unsigned i = 0; i < HYST_IIR_MAX_SECTIONS; i++) {
        large.shape[i] = (hyst_iir_section_t){.b0 = HYST_Q28_ONE};
    }
    const uint32_t tone = HYST_COST_TONE * HYST_COST_CYCLES_PER_INSTRUCTION;
    uint32_t core_hz = 16000000;
    while (budget(core_hz) < hyst_cost_cycles(&small) + ROOM * tone) {
        core_hz += 10000;
    }
    fake_core_hz = core_hz;
    fake_board_power_on(0);
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&small));
    (void)fake_board_run(10);
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_TOO_COSTLY, commit(&large));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_COMPENSATE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_MULTISINE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, 1U << 20));
    for (unsigned i = 0; i <= ROOM; i++) {
        const uint32_t words[] = {i + 1U, 1000, 0};
        master_write_words((uint16_t)(ADDRESS_tones + 6U * i), words, 3);
    }
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_tones, ROOM + 1));
    TEST_ASSERT_EQUAL(MODBUS_ILLEGAL_VALUE, master_set(INDEX_command, COMMAND_START));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_SINE));
    TEST_ASSERT_EQUAL_MESSAGE(MODBUS_OK, master_set(INDEX_command, COMMAND_START), "a sine has no tones");
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, COMMAND_STOP));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_MULTISINE));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_tones, ROOM));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, COMMAND_START));
}

/* An image that is committed while tones play has to leave time for them; where it does not, stopping them first helps.
 */
static void test_an_image_has_to_leave_time_for_the_tones_that_play(void) {
    enum { TONES = 5 };
    const hyst_parameters_t small = plays(10), large = plays(256);
    const uint32_t tone = HYST_COST_TONE * HYST_COST_CYCLES_PER_INSTRUCTION;
    uint32_t core_hz = 16000000;
    while (budget(core_hz) < hyst_cost_cycles(&large) + TONES * tone - 1U) {
        core_hz += 10000;
    }
    for (unsigned room = 0; room < 2; room++) {
        fake_core_hz = room == 0 ? core_hz - 10000U : core_hz + 100000U;
        fake_board_power_on(0);
        TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&small));
        (void)fake_board_run(10);
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_COMPENSATE));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source, SOURCE_MULTISINE));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_increment, 1U << 20));
        for (unsigned i = 0; i < TONES; i++) {
            const uint32_t words[] = {i + 1U, 1000, 0};
            master_write_words((uint16_t)(ADDRESS_tones + 6U * i), words, 3);
        }
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_source_tones, TONES));
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, COMMAND_START));
        (void)fake_board_run(10);
        TEST_ASSERT_EQUAL(room == 0 ? HYST_PARAMETERS_TOO_COSTLY : HYST_PARAMETERS_OK, commit(&large));
        TEST_ASSERT_EQUAL_UINT32(hyst_cost_cycles(&large), master_get(INDEX_image_cost));
        TEST_ASSERT_EQUAL_UINT32(AMPLIFIER_RUN, master_get(INDEX_amplifier_state));
        (void)fake_board_run(1000);
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_command, COMMAND_STOP));
        TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&large));
        (void)fake_board_run(1000);
        TEST_ASSERT_EQUAL(room == 0 ? MODBUS_ILLEGAL_VALUE : MODBUS_OK, master_set(INDEX_command, COMMAND_START));
    }
}

static unsigned late_samples(unsigned most, bool (*go_on)(void)) {
    const loop_input_t late = {.faults = FAULT_OVERRUN, .position_code = BOARD_CODE_MIDDLE};
    unsigned samples = 0;
    while (samples < most && go_on()) {
        (void)loop_sample(&late);
        samples++;
    }
    return samples;
}

static bool always(void) {
    return true;
}

/* Many reversals, each smaller than the one before, make a memory that takes many samples to carry over. */
static void test_late_samples_of_an_adoption_do_not_trip_and_others_do(void) {
    hyst_parameters_t p = plays(64);
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&p));
    (void)fake_board_run(300);
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_mode, HYST_MODE_DIRECT));
    TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint_slew, (uint32_t)HYST_Q31_MAX));
    for (int32_t amplitude = HYST_Q31_MAX / 40 * 38, sign = 1; amplitude > 0; amplitude -= HYST_Q31_MAX / 40) {
        TEST_ASSERT_EQUAL(MODBUS_OK, master_set(INDEX_setpoint, (uint32_t)(sign * amplitude)));
        (void)fake_board_run(20);
        sign = -sign;
    }
    p.model_id = 1;
    TEST_ASSERT_EQUAL(HYST_PARAMETERS_OK, commit(&p));
    const unsigned samples = late_samples(1000, loop_adoption_pending);
    TEST_ASSERT_GREATER_THAN_UINT(2 * LOOP_OVERRUNS_TO_TRIP, samples);
    TEST_ASSERT_LESS_THAN_UINT_MESSAGE(1000, samples, "it ends");
    TEST_ASSERT_FALSE(loop_in_fault());
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(samples, master_get(INDEX_overruns), "they are counted");
    (void)late_samples(LOOP_OVERRUNS_TO_TRIP - 1, always);
    TEST_ASSERT_FALSE(loop_in_fault());
    (void)late_samples(1, always);
    TEST_ASSERT_TRUE(loop_in_fault());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_image_is_accepted_where_its_worst_sample_fits_the_period);
    RUN_TEST(test_a_stored_image_that_no_longer_fits_is_not_started_with);
    RUN_TEST(test_a_multisine_is_refused_with_more_tones_than_there_is_time_for);
    RUN_TEST(test_an_image_has_to_leave_time_for_the_tones_that_play);
    RUN_TEST(test_late_samples_of_an_adoption_do_not_trip_and_others_do);
    return UNITY_END();
}
