/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Drive and displacement that changed places are refused, in recordings of three drives; what only looks so is not. */
#include "interface/exchanged.h"
#include "look/swapped.h"
#include "looked_at.h"
#include "unity.h"
#include <string.h>

static random_t rng;
static scene_t scene;
static recording_t recording;
static failure_t failure;

void setUp(void) {
}

void tearDown(void) {
}

static void record(size_t which) {
    scene_open(&scene, which, &rng);
    scene_record(&scene, NULL, &rng, &recording);
}

static void close_all(void) {
    recording_free(&recording);
    scene_close(&scene);
}

static void test_exchanged_columns_are_refused(void) {
    for (size_t which = 0; which < SCENE_DRIVES; which++) {
        record(which);
        TEST_ASSERT_TRUE_MESSAGE(exchanged_refuse(&recording, 1, NULL, &failure), failure.text);
        double *u = recording.column[COLUMN_DRIVE];
        recording.column[COLUMN_DRIVE] = recording.column[COLUMN_DISPLACEMENT];
        recording.column[COLUMN_DISPLACEMENT] = u;
        TEST_ASSERT_FALSE(exchanged_refuse(&recording, 1, "a hint", &failure));
        TEST_ASSERT_NOT_NULL(strstr(failure.text, ": drive and displacement are exchanged: "));
        TEST_ASSERT_NOT_NULL(strstr(failure.text, "; a hint"));
        close_all();
    }
}

/* What looks exchanged and is not: a measured drive with noise, and a position that is early. The fits decide. */
static void test_early_position_is_right(void) {
    size_t suspected = 0;
    for (size_t which = 0; which < SCENE_DRIVES; which++) {
        enum { LATE = 40 };
        record(which);
        double *u = recording.column[COLUMN_DRIVE], range[2];
        values_range(u, SCENE_SAMPLES, range);
        for (size_t k = SCENE_SAMPLES; k-- > 0;) {
            u[k] = u[k >= LATE ? k - LATE : 0] + 0.003 * (range[1] - range[0]) * random_normal(&rng);
        }
        suspected += swapped_suspected(&recording) ? 1 : 0;
        TEST_ASSERT_TRUE_MESSAGE(exchanged_refuse(&recording, 1, NULL, &failure), failure.text);
        close_all();
    }
    TEST_ASSERT_TRUE_MESSAGE(suspected > 0, "this tests nothing");
}

int main(void) {
    rng = random_start("exchanged", 20261128);
    UNITY_BEGIN();
    RUN_TEST(test_exchanged_columns_are_refused);
    RUN_TEST(test_early_position_is_right);
    return UNITY_END();
}
