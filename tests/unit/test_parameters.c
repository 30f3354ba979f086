/* SPDX-License-Identifier: MIT */
/* The parameter image: round trip, every way of breaking it, and the validator's verdict on every field. */
#include "hyst/parameters.h"
#include "models.h"
#include "unity.h"
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static const hyst_iir_section_t notch = {HYST_Q28_ONE, -HYST_Q28_ONE, HYST_Q28_ONE / 2, -HYST_Q28_ONE,
                                         HYST_Q28_ONE / 4};

static hyst_parameters_t sample_parameters(uint32_t operators) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    const pi_arguments_t a = pi_random(&rng, operators, true);
    p.model_id = 0xCAFE1234U;
    p.pi_operators = a.operators;
    p.hysteresis_offset = a.offset;
    p.pi_beta = a.beta;
    p.pi_rate_gain = a.rate_gain;
    memcpy(p.pi_weight, a.weight, sizeof p.pi_weight);
    memcpy(p.pi_threshold, a.threshold, sizeof p.pi_threshold);
    p.shape_sections = 2;
    p.shape[0] = notch;
    p.shape[1] = notch;
    p.equalise_sections = 1;
    p.equalise[0] = notch;
    p.creep_cells = 2;
    p.creep[0] = (hyst_creep_cell_t){HYST_Q31_MAX / 50, 1};
    p.creep[1] = (hyst_creep_cell_t){HYST_Q31_MAX / 50, HYST_Q31_MAX};
    return p;
}

static void expect(hyst_parameters_fault_t fault, hyst_parameters_error_t error, hyst_field_t field, uint32_t element) {
    TEST_ASSERT_EQUAL_STRING(hyst_parameters_error_text(error), hyst_parameters_error_text(fault.error));
    TEST_ASSERT_EQUAL_STRING(hyst_field_text(field), hyst_field_text(fault.field));
    TEST_ASSERT_EQUAL_UINT32(element, fault.element);
}

static void test_crc_is_the_ethernet_one(void) {
    /* "12345678" little endian; CRC-32/ISO-HDLC of these eight bytes is 0x9AE0DAAF (zlib.crc32). */
    const uint32_t words[2] = {0x34333231U, 0x38373635U};
    TEST_ASSERT_EQUAL_HEX32(0x9AE0DAAFU, hyst_crc32(words, 2));
}

static void test_round_trip(void) {
    for (uint32_t operators = 0; operators <= HYST_PI_MAX_OPERATORS; operators++) {
        const hyst_parameters_t p = sample_parameters(operators);
        uint32_t image[HYST_IMAGE_MAX_WORDS];
        const size_t length = hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS);
        TEST_ASSERT_EQUAL_UINT32(HYST_IMAGE_HEADER_WORDS + 1 + 2 * operators + 5 * 3 + 2 * 2 + 1, length);
        hyst_parameters_t back;
        expect(hyst_parameters_decode(image, length, &back), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
        uint32_t again[HYST_IMAGE_MAX_WORDS];
        TEST_ASSERT_EQUAL_UINT32(length, hyst_parameters_encode(&back, again, HYST_IMAGE_MAX_WORDS));
        TEST_ASSERT_EQUAL_MEMORY(image, again, length * sizeof image[0]);
        hyst_compensator_t compensator;
        expect(hyst_parameters_build(&back, &compensator), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
        TEST_ASSERT_EQUAL_UINT32(operators, compensator.hysteresis.prandtl_ishlinskii.operators);
    }
}

static void test_largest_image_fits_exactly(void) {
    hyst_parameters_t p = sample_parameters(HYST_PI_MAX_OPERATORS);
    p.shape_sections = HYST_IIR_MAX_SECTIONS;
    p.drive_curves = p.reference_curves = 1;
    p.inertia_sections = HYST_INERTIA_MAX_SECTIONS;
    p.equalise_sections = HYST_IIR_MAX_SECTIONS;
    p.creep_cells = HYST_CREEP_MAX_CELLS;
    uint32_t image[HYST_IMAGE_MAX_WORDS];
    TEST_ASSERT_EQUAL_UINT32(HYST_IMAGE_MAX_WORDS, hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS));
    TEST_ASSERT_EQUAL_UINT32(0, hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS - 1));
    p.equalise_sections++;
    TEST_ASSERT_EQUAL_UINT32(0, hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS));
}

static void test_every_single_bit_flip_is_noticed(void) {
    const hyst_parameters_t p = sample_parameters(10);
    uint32_t image[HYST_IMAGE_MAX_WORDS];
    const size_t length = hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS);
    for (size_t word = 0; word < length; word++) {
        for (unsigned bit = 0; bit < 32; bit++) {
            image[word] ^= UINT32_C(1) << bit;
            hyst_parameters_t back;
            TEST_ASSERT_NOT_EQUAL(HYST_PARAMETERS_OK, hyst_parameters_decode(image, length, &back).error);
            image[word] ^= UINT32_C(1) << bit;
        }
    }
}

static void test_every_truncation_is_noticed(void) {
    const hyst_parameters_t p = sample_parameters(10);
    uint32_t image[HYST_IMAGE_MAX_WORDS];
    const size_t length = hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS);
    hyst_parameters_t back;
    for (size_t count = 0; count < length; count++) {
        expect(hyst_parameters_decode(image, count, &back), HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS, 0);
    }
    expect(hyst_parameters_decode(image, HYST_IMAGE_MAX_WORDS + 1, &back), HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS,
           0);
}

/* An image whose word is changed and whose CRC is made right again: the fault must be found by its meaning. */
static hyst_parameters_fault_t forged(uint32_t word, uint32_t value) {
    const hyst_parameters_t p = sample_parameters(10);
    uint32_t image[HYST_IMAGE_MAX_WORDS];
    const size_t length = hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS);
    image[word] = value;
    image[length - 1] = hyst_crc32(image, length - 1);
    hyst_parameters_t back;
    hyst_compensator_t compensator;
    const hyst_parameters_fault_t fault = hyst_parameters_decode(image, length, &back);
    return fault.error == HYST_PARAMETERS_OK ? hyst_parameters_build(&back, &compensator) : fault;
}

static void test_validator_names_the_field(void) {
    const hyst_parameters_error_t range = HYST_PARAMETERS_OUT_OF_RANGE;
    const hyst_parameters_error_t clash = HYST_PARAMETERS_INCONSISTENT;
    expect(forged(0, 1), HYST_PARAMETERS_BAD_MAGIC, HYST_FIELD_MAGIC, 0);
    expect(forged(1, 1), HYST_PARAMETERS_BAD_VERSION, HYST_FIELD_VERSION, 0);
    expect(forged(2, 40), HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS, 0);
    expect(forged(4, 999), range, HYST_FIELD_SAMPLE_RATE, 0);
    expect(forged(4, 1000000001), range, HYST_FIELD_SAMPLE_RATE, 0);
    expect(forged(6, 0), range, HYST_FIELD_DRIVE_HALF_RANGE, 0);
    expect(forged(8, 0x80000000U), range, HYST_FIELD_POSITION_HALF_RANGE, 0);
    expect(forged(9, INT32_MAX), clash, HYST_FIELD_DRIVE_LOW, 0);
    expect(forged(10, (uint32_t)-5), clash, HYST_FIELD_DRIVE_PARK, 0);
    expect(forged(13, 0), range, HYST_FIELD_LINEAR_GAIN, 0);
    expect(forged(14, 0), range, HYST_FIELD_TRANSITION_SLEW, 0);
    expect(forged(15, 64), range, HYST_FIELD_LOOKAHEAD, 0);
    expect(forged(18, HYST_PI_MAX_OPERATORS + 1), range, HYST_FIELD_PI_OPERATORS, 0);
    expect(forged(18, UINT32_MAX), range, HYST_FIELD_PI_OPERATORS, 0);
    expect(forged(18, 9), HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS, 0);
    expect(forged(16, HYST_FAMILY_COUNT), range, HYST_FIELD_FAMILY, 0);
    expect(forged(16, HYST_FAMILY_PREISACH), clash, HYST_FIELD_PI_OPERATORS, 0);
    expect(forged(19, UINT32_MAX), range, HYST_FIELD_PI_BETA, 0);
    expect(forged(20, 0), range, HYST_FIELD_PI_RATE_GAIN, 0);
    expect(forged(27, 5), range, HYST_FIELD_SHAPE_SECTIONS, 0);
    expect(forged(21, HYST_PREISACH_MAX_INTERVALS + 1), range, HYST_FIELD_PREISACH_INTERVALS, 0);
    expect(forged(22, HYST_BOUC_WEN_MAX_CELLS + 1), range, HYST_FIELD_BOUC_WEN_CELLS, 0);
    expect(forged(24, 2), range, HYST_FIELD_MODIFIED_PLAYS, 0);
    expect(forged(25, 2), range, HYST_FIELD_DRIVE_CURVES, 0);
    expect(forged(26, 2), range, HYST_FIELD_REFERENCE_CURVES, 0);
    expect(forged(26, 1), HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS, 0);
    expect(forged(28, 2), range, HYST_FIELD_INERTIA_SECTIONS, 0);
    expect(forged(29, UINT32_MAX), range, HYST_FIELD_EQUALISE_SECTIONS, 0);
    expect(forged(31, 0), HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_PI_WEIGHT, 0);
    expect(forged(31 + 4, 0x7FFFFFFF), range, HYST_FIELD_PI_WEIGHT, 4);
    expect(forged(42, 0), range, HYST_FIELD_PI_THRESHOLD, 0);
    expect(forged(42 + 9, 1), clash, HYST_FIELD_PI_THRESHOLD, 9);
    expect(forged(52 + 4, (uint32_t)HYST_Q28_ONE), HYST_PARAMETERS_UNSTABLE, HYST_FIELD_SHAPE, 0);
    expect(forged(52 + 9, (uint32_t)HYST_Q28_ONE), HYST_PARAMETERS_UNSTABLE, HYST_FIELD_SHAPE, 1);
    expect(forged(62, 0x80000000U), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
    expect(forged(62 + 4, (uint32_t)HYST_Q28_ONE), HYST_PARAMETERS_UNSTABLE, HYST_FIELD_EQUALISE, 0);
    expect(forged(30, HYST_CREEP_MAX_CELLS + 1), range, HYST_FIELD_CREEP_CELLS, 0);
    expect(forged(67, 0x7FFFFFFF), range, HYST_FIELD_CREEP, 1);
    expect(forged(67 + 3, 0), range, HYST_FIELD_CREEP, 1);
}

static hyst_parameters_t preisach_parameters(uint32_t intervals) {
    hyst_parameters_t p = sample_parameters(0);
    p.family = HYST_FAMILY_PREISACH;
    p.preisach_intervals = intervals;
    for (uint32_t i = 1; i <= intervals; i++) {
        for (uint32_t j = 0; j < i; j++) { /* slope 1 everywhere */
            p.preisach_everett[HYST_PREISACH_ELEMENTS(i - 1U) + j] =
                (hyst_q28_t)(2 * HYST_Q28_ONE / intervals * (i - j));
        }
    }
    return p;
}

static void test_every_preisach_table_survives_the_image(void) {
    for (uint32_t intervals = 1; intervals <= HYST_PREISACH_MAX_INTERVALS; intervals++) {
        const hyst_parameters_t p = preisach_parameters(intervals);
        uint32_t image[HYST_IMAGE_MAX_WORDS];
        const size_t length = hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS);
        TEST_ASSERT_EQUAL_UINT32(HYST_IMAGE_HEADER_WORDS + 1 + intervals * (intervals + 1) / 2 + 5 * 3 + 2 * 2 + 1,
                                 length);
        hyst_parameters_t back;
        hyst_compensator_t compensator;
        expect(hyst_parameters_decode(image, length, &back), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
        TEST_ASSERT_EQUAL_MEMORY(p.preisach_everett, back.preisach_everett, sizeof p.preisach_everett);
        expect(hyst_parameters_build(&back, &compensator), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
        TEST_ASSERT_EQUAL_INT(HYST_FAMILY_PREISACH, compensator.hysteresis.family);
    }
    hyst_compensator_t compensator;
    hyst_parameters_t p = preisach_parameters(4);
    p.preisach_everett[7] = p.preisach_everett[4]; /* E(4,1) = E(3,1): a flat branch */
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_PREISACH_EVERETT, 7);
    p.preisach_intervals = 0;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PREISACH_INTERVALS, 0);
}

static void test_refusals_of_the_other_families_point_at_their_fields(void) {
    hyst_compensator_t compensator;
    hyst_parameters_t p = sample_parameters(0);
    p.family = HYST_FAMILY_BOUC_WEN;
    p.bouc_wen_cells = 2;
    p.bouc_wen_direct = HYST_Q28_ONE / 2;
    p.bouc_wen_length[0] = p.bouc_wen_length[1] = HYST_Q31_MAX / 4;
    p.bouc_wen_slope[0] = p.bouc_wen_slope[1] = HYST_Q28_ONE / 8;
    uint32_t image[HYST_IMAGE_MAX_WORDS];
    const size_t length = hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS);
    TEST_ASSERT_EQUAL_UINT32(HYST_IMAGE_HEADER_WORDS + 1 + 2 * 2 + 5 * 3 + 2 * 2 + 1, length);
    hyst_parameters_t back;
    expect(hyst_parameters_decode(image, length, &back), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
    expect(hyst_parameters_build(&back, &compensator), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
    p.bouc_wen_length[1] = 0;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_BOUC_WEN_LENGTH, 1);
    p.bouc_wen_length[1] = 1;
    p.bouc_wen_slope[1] = -1;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_INCONSISTENT, HYST_FIELD_BOUC_WEN_SLOPE, 1);
    p.bouc_wen_slope[0] = p.bouc_wen_slope[1] = -HYST_Q28_ONE / 2;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_BOUC_WEN_SLOPE, 0);
    p.modified_plays = 1;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_INCONSISTENT, HYST_FIELD_MODIFIED_PLAYS, 0);
    p.family = HYST_FAMILY_MODIFIED_PLAY;
    p.bouc_wen_cells = 0;
    p.modified_play[0].divisions = 1;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_MODIFIED_PLAY, 0);
    p.modified_play[0].direct = HYST_Q28_ONE;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
    p.modified_play[0].feedback[0] = HYST_Q28_ONE;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_UNSTABLE, HYST_FIELD_MODIFIED_PLAY, 0);
    p.modified_plays = 0;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_MODIFIED_PLAYS, 0);
}

static void test_unstable_rate_feedback_is_refused(void) {
    hyst_parameters_t p = sample_parameters(10);
    const pi_arguments_t a = pi_seed_004(HYST_Q30_ONE);
    memcpy(p.pi_weight, a.weight, sizeof p.pi_weight);
    memcpy(p.pi_threshold, a.threshold, sizeof p.pi_threshold);
    p.pi_beta = a.beta;
    p.pi_rate_gain = a.rate_gain;
    hyst_compensator_t compensator;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_UNSTABLE, HYST_FIELD_PI_BETA, 1);
}

/* Parameters need not come from an image: the validator bounds the counts itself. */
static void test_counts_are_bounded_without_an_image_too(void) {
    hyst_compensator_t compensator;
    hyst_parameters_t p = sample_parameters(10);
    p.pi_operators = HYST_PI_MAX_OPERATORS + 1;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PI_OPERATORS, 0);
    p = sample_parameters(10);
    p.shape_sections = HYST_IIR_MAX_SECTIONS + 1;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_SHAPE_SECTIONS, 0);
    p = sample_parameters(10);
    p.equalise_sections = UINT32_MAX;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_EQUALISE_SECTIONS, 0);
    p = sample_parameters(10);
    p.creep_cells = HYST_CREEP_MAX_CELLS + 1;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_CREEP_CELLS, 0);
    p = sample_parameters(10);
    p.shape[1].b0 = INT32_MIN;
    p.shape[1].b1 = INT32_MAX;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_SHAPE, 1);
}

/* Random words behind a right frame: whatever is accepted must run without a sanitizer's complaint. */
static void test_random_images_never_break_anything(void) {
    unsigned accepted = 0;
    for (int run = 0; run < 200000; run++) {
        const hyst_parameters_t p = sample_parameters((uint32_t)(random_bits(&rng) % 12U));
        uint32_t image[HYST_IMAGE_MAX_WORDS];
        const size_t length = hyst_parameters_encode(&p, image, HYST_IMAGE_MAX_WORDS);
        const int changes = random_between(&rng, 1, 3);
        for (int k = 0; k < changes; k++) {
            image[3 + random_bits(&rng) % (length - 4)] = (uint32_t)random_q31(&rng) >> (random_bits(&rng) % 32U);
        }
        image[length - 1] = hyst_crc32(image, length - 1);
        hyst_parameters_t back;
        hyst_compensator_t compensator;
        if (hyst_parameters_decode(image, length, &back).error == HYST_PARAMETERS_OK &&
            hyst_parameters_build(&back, &compensator).error == HYST_PARAMETERS_OK) {
            accepted++;
            hyst_compensator_state_t state;
            hyst_compensator_reset(&compensator, &state);
            for (int k = 0; k < 20; k++) {
                unsigned events;
                const hyst_q31_t drive = hyst_compensator_step(
                    &compensator, &state, (hyst_mode_t)(random_bits(&rng) % 4U), random_q31(&rng), &events);
                TEST_ASSERT_TRUE(drive >= compensator.drive_low && drive <= compensator.drive_high);
            }
        }
    }
    TEST_ASSERT_TRUE(accepted > 1000);
}

static void test_default_is_valid(void) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    hyst_compensator_t compensator;
    expect(hyst_parameters_build(&p, &compensator), HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
}

static void test_texts_exist_for_every_code(void) {
    for (int field = 0; field < HYST_FIELD_COUNT; field++) {
        TEST_ASSERT_NOT_NULL(hyst_field_text((hyst_field_t)field));
    }
    TEST_ASSERT_EQUAL_STRING("unknown field", hyst_field_text(HYST_FIELD_COUNT));
    TEST_ASSERT_EQUAL_STRING("unstable", hyst_parameters_error_text(HYST_PARAMETERS_UNSTABLE));
    TEST_ASSERT_EQUAL_STRING("unknown error", hyst_parameters_error_text((hyst_parameters_error_t)99));
}

int main(void) {
    rng = random_start("test_parameters", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_crc_is_the_ethernet_one);
    RUN_TEST(test_round_trip);
    RUN_TEST(test_largest_image_fits_exactly);
    RUN_TEST(test_every_single_bit_flip_is_noticed);
    RUN_TEST(test_every_truncation_is_noticed);
    RUN_TEST(test_validator_names_the_field);
    RUN_TEST(test_every_preisach_table_survives_the_image);
    RUN_TEST(test_refusals_of_the_other_families_point_at_their_fields);
    RUN_TEST(test_unstable_rate_feedback_is_refused);
    RUN_TEST(test_counts_are_bounded_without_an_image_too);
    RUN_TEST(test_random_images_never_break_anything);
    RUN_TEST(test_default_is_valid);
    RUN_TEST(test_texts_exist_for_every_code);
    return UNITY_END();
}
