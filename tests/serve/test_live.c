/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a snapshot, and a block of the stream, become on the page: warnings in words, those of newer firmware by their
 * value. */
#include "hyst/parameters.h"
#include "loop/telemetry.h"
#include "serve/folder.h"
#include "serve/live.h"
#include "unity.h"
#include <string.h>

static hyst_parameters_t image;
static json_t *told;

void setUp(void) {
    hyst_parameters_default(&image);
    image.position_half_range_pm = 40000000; /* 40 um */
}

void tearDown(void) {
    json_decref(told);
    told = NULL;
}

static void tell(int64_t live, int64_t sticky, int64_t blocks) {
    int64_t now[REGISTER_COUNT] = {0};
    live_clock_t clock = {0};
    now[INDEX_warnings_live] = live;
    now[INDEX_warnings_sticky] = sticky;
    now[INDEX_model_error_blocks] = blocks;
    now[INDEX_model_error_rms] = INT64_C(1) << 21; /* 2^-10 of full scale */
    json_decref(told);
    told = live_snapshot(&clock, now, &image, 10000.0);
    TEST_ASSERT_NOT_NULL(told);
}

static const char *warning(const char *key, size_t index) {
    return json_string_value(json_array_get(json_object_get(told, key), index));
}

static void expect_words(int64_t bit, const char *words) {
    tell(bit, 0, 0);
    TEST_ASSERT_EQUAL_UINT(1, json_array_size(json_object_get(told, "warnings")));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(warning("warnings", 0), words), warning("warnings", 0));
}

static void test_each_warning_has_words_of_its_own(void) {
    expect_words(WARNING_MODEL, "the model is no longer true");
    expect_words(WARNING_SENSOR, "the sensor is lost");
    expect_words(WARNING_CONVERTER, "stands still");
    expect_words(WARNING_TEMPERATURE, "hot");
}

static void test_what_warned_before_and_what_nobody_knows(void) {
    tell(0, WARNING_MODEL | WARNING_TEMPERATURE | 0x4000, 0);
    TEST_ASSERT_EQUAL_UINT(0, json_array_size(json_object_get(told, "warnings")));
    TEST_ASSERT_EQUAL_UINT(3, json_array_size(json_object_get(told, "warnings_before")));
    TEST_ASSERT_EQUAL_STRING("unknown (16384)", warning("warnings_before", 2));
}

static void test_the_models_error_is_told_once_it_is_watched(void) {
    tell(0, 0, 0);
    TEST_ASSERT_TRUE(json_is_null(json_object_get(told, "model_error")));
    tell(0, 0, 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0391, json_number_value(json_object_get(told, "model_error"))); /* 40 / 1024 */
}

static double number(const char *key, size_t index) {
    const json_t *member = json_object_get(told, key);
    return json_number_value(json_is_array(member) ? json_array_get(member, index) : member);
}

/* What commands print begins with no "./" where the server works in its folder. */
static void test_files_of_the_folder_have_their_names(void) {
    char path[FOLDER_PATH];
    failure_t failure;
    TEST_ASSERT_TRUE(folder_path(".", "a.csv", path, &failure));
    TEST_ASSERT_EQUAL_STRING("a.csv", path);
    TEST_ASSERT_TRUE(folder_path("lab/2", "a.csv", path, &failure));
    TEST_ASSERT_EQUAL_STRING("lab/2/a.csv", path);
    TEST_ASSERT_FALSE(folder_path(".", "../a.csv", path, &failure));
}

/* On the time of the snapshots, over the wrap of the sample's number; in units. */
static void test_frames_of_the_stream(void) {
    const live_clock_t clock = {.begun = true, .last = 5, .samples = 20000.0};
    const stream_block_t block = {.lost = 7,
                                  .first = 1234,
                                  .frames = 2,
                                  .sample = 0U - 15U, /* 20 before the snapshot */
                                  .decimation = 10,
                                  .signals = CAPTURE_DEFAULT_SIGNALS,
                                  .width = 3,
                                  .value = {0x4000, 0xC000, 0, 0x2000, 0, 0x6000}};
    image.drive_half_range_uv = 100000000; /* 100 V */
    told = live_stream(&clock, &block, true, &image, 10000.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.998, number("t", 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.001, number("step", 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1234.0, number("first", 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 7.0, number("lost", 0));
    TEST_ASSERT_EQUAL_UINT(2, json_array_size(json_object_get(told, "drive")));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 20.0, number("reference", 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, -50.0, number("drive", 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.0, number("position", 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 10.0, number("reference", 1));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 30.0, number("position", 1));
    json_decref(told);
    told = live_stream(&clock, &block, false, &image, 10000.0);
    TEST_ASSERT_TRUE(json_is_null(json_object_get(told, "reference")));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_each_warning_has_words_of_its_own);
    RUN_TEST(test_what_warned_before_and_what_nobody_knows);
    RUN_TEST(test_the_models_error_is_told_once_it_is_watched);
    RUN_TEST(test_files_of_the_folder_have_their_names);
    RUN_TEST(test_frames_of_the_stream);
    return UNITY_END();
}
