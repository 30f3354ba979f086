/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Image files: the same validator as the amplifier's, one line without endy kind of damage. */
#include "compile/compile.h"
#include "support.h"
#include "unity.h"
#include <stdio.h>
#include <string.h>

static const char file[] = "test_image.bin";
static unsigned char image[4 * HYST_IMAGE_MAX_WORDS];
static size_t length;

void setUp(void) {
    const double weights[] = {0.5, 0.1, 0.2}, thresholds[] = {10.0, 30.0};
    const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-80.0, 80.0}};
    hyst_parameters_t parameters;
    model_t model;
    failure_t failure;
    FILE *stream;
    make_bank_model(&model, 10000.0, 1.0, 2, weights, thresholds);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, NULL, &failure), failure.text);
    TEST_ASSERT_TRUE(image_write(&parameters, file, &failure));
    model_free(&model);
    stream = fopen(file, "rb");
    TEST_ASSERT_NOT_NULL(stream);
    length = fread(image, 1, sizeof image, stream);
    fclose(stream);
}

void tearDown(void) {
    remove(file);
}

static bool read_back(hyst_parameters_t *parameters, failure_t *failure) {
    write_file(file, (const char *)image, length);
    return image_read(parameters, file, failure);
}

static void test_written_image_is_read_and_starts_with_its_magic(void) {
    hyst_parameters_t parameters;
    failure_t failure;
    TEST_ASSERT_TRUE_MESSAGE(read_back(&parameters, &failure), failure.text);
    TEST_ASSERT_EQUAL_MEMORY("TSYH", image, 4); /* least significant byte first */
    TEST_ASSERT_EQUAL_UINT64(4 * parameters.pi_operators * 2 + 4 * (HYST_IMAGE_HEADER_WORDS + 2), length);
    TEST_ASSERT_EQUAL_INT32(100000000, parameters.drive_half_range_uv);
}

static void test_every_flipped_bit_is_refused(void) {
    hyst_parameters_t parameters;
    for (size_t bit = 0; bit < 8 * length; bit++) {
        failure_t failure = {{0}};
        image[bit / 8] ^= (unsigned char)(1U << (bit % 8));
        TEST_ASSERT_FALSE(read_back(&parameters, &failure));
        expect_line(&failure, "test_image.bin: refused: ");
        image[bit / 8] ^= (unsigned char)(1U << (bit % 8));
    }
}

static void test_every_truncation_is_refused(void) {
    hyst_parameters_t parameters;
    const size_t whole = length;
    for (length = 0; length < whole; length++) {
        failure_t failure = {{0}};
        TEST_ASSERT_FALSE(read_back(&parameters, &failure));
        expect_line(&failure, length % 4 == 0 && length > 0 ? "refused" : "not a parameter image");
    }
    length = sizeof image;
    failure_t failure;
    TEST_ASSERT_FALSE(read_back(&parameters, &failure));
}

static void test_a_file_that_is_too_long_is_refused(void) {
    static char large[4 * HYST_IMAGE_MAX_WORDS + 100];
    hyst_parameters_t parameters;
    failure_t failure;
    write_file(file, large, sizeof large);
    TEST_ASSERT_FALSE(image_read(&parameters, file, &failure));
    expect_line(&failure, "not a parameter image: more than");
}

static void test_a_valid_crc_over_nonsense_is_refused_by_field(void) {
    hyst_parameters_t parameters;
    failure_t failure;
    TEST_ASSERT_TRUE(read_back(&parameters, &failure));
    parameters.pi_threshold[1] = parameters.pi_threshold[0];
    TEST_ASSERT_TRUE(image_write(&parameters, file, &failure));
    TEST_ASSERT_FALSE(image_read(&parameters, file, &failure));
    expect_line(&failure, hyst_field_text(HYST_FIELD_PI_THRESHOLD));
    expect_line(&failure, "element 1");
    parameters.pi_operators = HYST_PI_MAX_OPERATORS + 1;
    TEST_ASSERT_FALSE(image_write(&parameters, file, &failure));
    expect_line(&failure, "do not fit");
    TEST_ASSERT_FALSE(image_read(&parameters, "no_such_image", &failure));
    expect_line(&failure, "no_such_image: No such file");
}

static void test_units_round_and_saturate(void) {
    hyst_parameters_t parameters;
    failure_t failure;
    TEST_ASSERT_TRUE(read_back(&parameters, &failure));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, drive_from_volts(&parameters, 1e6));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, drive_from_volts(&parameters, -1e6));
    TEST_ASSERT_EQUAL_INT32(0, drive_from_volts(&parameters, 0.0));
    TEST_ASSERT_EQUAL_INT32(1 << 30, position_from_micrometres(&parameters, 40.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -100.0, drive_to_volts(&parameters, INT32_MIN));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 40.0, position_to_micrometres(&parameters, 1 << 30));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_written_image_is_read_and_starts_with_its_magic);
    RUN_TEST(test_every_flipped_bit_is_refused);
    RUN_TEST(test_every_truncation_is_refused);
    RUN_TEST(test_a_file_that_is_too_long_is_refused);
    RUN_TEST(test_a_valid_crc_over_nonsense_is_refused_by_field);
    RUN_TEST(test_units_round_and_saturate);
    return UNITY_END();
}
