/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The C interface for other languages: what it makes is what the library makes, and work ends on request. */
#include "interface/hyst_interface.h"
#include "support.h"
#include <string.h>
#include <unity.h>

enum { SAMPLES = 3000 };
static const double rate_hz = 1000.0;
static hyst_host_recording_t *recording;
static hyst_host_model_t *actuator;

static const char actuator_text[] =
    "{\"format\": \"hyst-model-1\", \"sample_rate_hz\": 1000, \"chain\": ["
    "{\"block\": \"prandtl_ishlinskii\", \"parameters\": {\"offset_um\": 2, \"weights\": [0.2, 0.03, 0.02],"
    " \"thresholds_v\": [8, 30]}},"
    "{\"block\": \"resonance\", \"parameters\": {\"frequency_hz\": 90, \"damping_ratio\": 0.05}}],"
    "\"fit\": {\"drive_range_v\": [0, 100], \"displacement_range_um\": [0, 35]}}";

void setUp(void) {
    static const double corner[] = {50.0, 100.0, 0.0, 80.0, 20.0, 60.0};
    double drive[SAMPLES], position[SAMPLES];
    random_t rng = random_start("python_interface", 19);
    fill_lines(drive, SAMPLES, corner, sizeof corner / sizeof corner[0], 50);
    actuator = hyst_host_model_from_json(actuator_text);
    TEST_ASSERT_NOT_NULL_MESSAGE(actuator, hyst_host_error());
    TEST_ASSERT_TRUE(hyst_host_simulate(actuator, rate_hz, SAMPLES, drive, NULL, position));
    for (size_t k = 0; k < SAMPLES; k++) {
        position[k] += 0.01 * random_normal(&rng);
    }
    recording = hyst_host_recording_make("made", rate_hz, SAMPLES);
    TEST_ASSERT_TRUE(hyst_host_recording_set_column(recording, "drive", drive));
    TEST_ASSERT_TRUE(hyst_host_recording_set_column(recording, "displacement", position));
    hyst_host_cancel(0);
}

void tearDown(void) {
    hyst_host_on_progress(NULL, NULL);
    hyst_host_cancel(0);
    hyst_host_recording_free(recording);
    hyst_host_model_free(actuator);
}

/* Ends the work once it has heard so many reports. */
static int end_after(void *context, const char *what, double fraction) {
    int *left = context;
    TEST_ASSERT_TRUE(strcmp(what, "fitting") == 0 || strncmp(what, "looking", 7) == 0 ||
                     strncmp(what, "diagnosing: ", 12) == 0);
    TEST_ASSERT_TRUE(fraction >= 0.0 && fraction <= 1.0);
    return --*left == 0;
}

static void test_a_diagnosis_that_is_ended_anywhere_leaves_nothing_behind(void) {
    const hyst_host_recording_t *const all[] = {recording};
    bool done = false;
    int ended = 0;
    for (int reports = 1; !done && reports < 80; reports += 1 + reports / 3) {
        int left = reports;
        hyst_host_cancel(0);
        hyst_host_on_progress(end_after, &left);
        hyst_host_diagnosis_t *diagnosis = hyst_host_diagnose(all, 1, NULL);
        done = diagnosis != NULL;
        if (!done) {
            TEST_ASSERT_EQUAL_STRING("interrupted", hyst_host_error());
            ended++;
        }
        hyst_host_diagnosis_free(diagnosis);
    }
    TEST_ASSERT_GREATER_THAN(4, ended);
}

static void test_work_that_was_asked_to_end_before_it_began_fails(void) {
    const hyst_host_recording_t *const all[] = {recording};
    hyst_host_cancel(1);
    TEST_ASSERT_NULL(hyst_host_fit(all, 1, NULL));
    TEST_ASSERT_EQUAL_STRING("interrupted", hyst_host_error());
    TEST_ASSERT_NULL(hyst_host_diagnose(all, 1, actuator));
    TEST_ASSERT_EQUAL_STRING("interrupted", hyst_host_error());
}

static void test_every_family_ends_when_it_is_asked_to(void) {
    const hyst_host_recording_t *const all[] = {recording};
    char *text = hyst_host_families();
    json_t *families = json_loads(text, 0, NULL), *family;
    size_t index;
    json_array_foreach(families, index, family) {
        char options[100];
        int left = 3;
        snprintf(options, sizeof options, "{\"family\": \"%s\"}", json_string_value(json_object_get(family, "name")));
        hyst_host_cancel(0);
        hyst_host_on_progress(end_after, &left);
        hyst_host_model_t *model = hyst_host_fit(all, 1, options);
        TEST_ASSERT_TRUE_MESSAGE(model == NULL || left > 0, options);
        hyst_host_model_free(model);
    }
    TEST_ASSERT_GREATER_THAN(5, index);
    json_decref(families);
    hyst_host_free(text);
}

static void test_options_are_read_strictly(void) {
    const hyst_host_recording_t *const all[] = {recording};
    size_t length;
    TEST_ASSERT_NULL(hyst_host_fit(all, 1, "{\"famly\": \"preisach\"}"));
    TEST_ASSERT_NOT_NULL(strstr(hyst_host_error(), "famly"));
    TEST_ASSERT_NULL(hyst_host_fit(all, 1, "{\"creep\": 3}"));
    TEST_ASSERT_NOT_NULL(strstr(hyst_host_error(), "options: "));
    TEST_ASSERT_NULL(hyst_host_fit(all, 1, "[]"));
    TEST_ASSERT_NULL(hyst_host_fit(all, 1, "{"));
    TEST_ASSERT_NULL(hyst_host_fit(all, 1, "{\"operators\": -1}"));
    TEST_ASSERT_NULL(hyst_host_fit(all, 0, NULL));
    TEST_ASSERT_NULL(hyst_host_compile(actuator, "{\"drive_range_v\": [1]}", &length, NULL));
    TEST_ASSERT_NULL(hyst_host_recording_read("x.csv", "{\"column\": {\"none\": 1}}"));
    TEST_ASSERT_EQUAL_STRING("a recording has no column 'none': it has drive, displacement, reference, voltage, "
                             "current, temperature",
                             hyst_host_error());
}

static void test_an_image_has_its_report(void) {
    size_t length = 0;
    char *report = NULL;
    unsigned char *image = hyst_host_compile(actuator, "{\"sample_rate_hz\": 10000}", &length, &report);
    TEST_ASSERT_NOT_NULL_MESSAGE(image, hyst_host_error());
    TEST_ASSERT_GREATER_THAN(100, length);
    TEST_ASSERT_NOT_NULL(strstr(report, "\"hysteresis\""));
    hyst_host_free(image);
    hyst_host_free(report);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_diagnosis_that_is_ended_anywhere_leaves_nothing_behind);
    RUN_TEST(test_work_that_was_asked_to_end_before_it_began_fails);
    RUN_TEST(test_every_family_ends_when_it_is_asked_to);
    RUN_TEST(test_options_are_read_strictly);
    RUN_TEST(test_an_image_has_its_report);
    return UNITY_END();
}
