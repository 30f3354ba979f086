/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a snapshot becomes on the page: warnings in words, those of newer firmware by their value. */
#include "hyst/parameters.h"
#include "serve/live.h"
#include "telemetry.h"
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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_each_warning_has_words_of_its_own);
    RUN_TEST(test_what_warned_before_and_what_nobody_knows);
    RUN_TEST(test_the_models_error_is_told_once_it_is_watched);
    return UNITY_END();
}
