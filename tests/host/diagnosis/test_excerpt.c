/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a diagnosis uses of a long recording: which window, its times, that it takes no more memory than the window
 * does, and that the error it tells is that of the whole. */
#include "base/progress.h"
#include "diagnosis/diagnose.h"
#include "diagnosis/question/excerpt.h"
#include "diagnosis/search/windows.h"
#include "interface/diagnosis_run.h"
#include "interface/exchanged.h"
#include "support.h"
#include "thresholds/thresholds.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>
#include <sys/resource.h>

static const double rate_hz = 1000.0;
static recording_t recording, other;
static failure_t failure;

void setUp(void) {
    recording = other = (recording_t){0};
    progress_cancel(false);
}

void tearDown(void) {
    progress_cancel(false);
    recording_free(&recording);
    recording_free(&other);
}

/* Triangles of so many samples; each displacement tells which sample it is of. */
static void make(recording_t *r, size_t samples, size_t period) {
    recording_create(r, "long.csv", rate_hz, samples);
    r->start_s = 2.0;
    for (size_t k = 0; k < samples; k++) {
        const double phase = (double)(k % period) / (double)period;
        r->column[COLUMN_DRIVE][k] = 100.0 * (phase < 0.5 ? 2.0 * phase : 2.0 - 2.0 * phase);
        r->column[COLUMN_DISPLACEMENT][k] = (double)k;
    }
}

static void expect_window(const recording_t *r, size_t first, size_t samples) {
    TEST_ASSERT_EQUAL_UINT64(samples, r->samples);
    TEST_ASSERT_EQUAL_UINT64(1, excerpt_mean_of(r));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0 + (double)first / rate_hz, recording_time(r, 0.0));
    for (size_t k = 0; k < samples; k++) {
        TEST_ASSERT_TRUE(r->column[COLUMN_DISPLACEMENT][k] == (double)(first + k));
        TEST_ASSERT_TRUE(r->column[COLUMN_DRIVE][k] == r->whole->column[COLUMN_DRIVE][first + k]);
    }
}

static void test_leaves_short_ones_alone(void) {
    make(&recording, 5000, 400);
    const double *drive = recording.column[COLUMN_DRIVE];
    char text[EXCERPT_LINE];
    excerpt(&recording, 1, 5000);
    TEST_ASSERT_NULL(recording.whole);
    TEST_ASSERT_EQUAL_PTR(drive, recording.column[COLUMN_DRIVE]);
    TEST_ASSERT_FALSE(excerpt_text(&recording, text));
}

/* Everywhere the same: the beginning. */
static void test_takes_the_first_of_equal_windows(void) {
    make(&recording, 50000, 400);
    excerpt(&recording, 1, 4000);
    expect_window(&recording, 0, 4000);
    TEST_ASSERT_EQUAL_UINT64(50000, recording.whole->samples);
}

/* The fast part is short and late, and both ends of the range are elsewhere, too. */
static void test_goes_where_the_drive_does_most(void) {
    make(&recording, 50000, 3000);
    for (size_t k = 41000; k < 41500; k++) {
        recording.column[COLUMN_DRIVE][k] = 50.0 + 30.0 * sin(0.3 * (double)k);
    }
    recording_set_key(&recording, "source", "test");
    recording.clock_s = 7.0;
    excerpt(&recording, 1, 4000);
    const double first = (recording_time(&recording, 0.0) - 2.0) * rate_hz;
    TEST_ASSERT_TRUE(first <= 41000.0 && first + 4000.0 >= 41500.0);
    expect_window(&recording, (size_t)(first + 0.5), 4000);
    TEST_ASSERT_EQUAL_STRING("test", recording_key(&recording, "source"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 7.0 + first / rate_hz, recording.clock_s);
}

/* An end of the range that the drive reaches once has to be in it, whatever else there is. */
static void test_sees_both_ends(void) {
    make(&recording, 50000, 400);
    recording.column[COLUMN_DRIVE][30100] = -60.0;
    for (size_t k = 10000; k < 12000; k++) { /* many rates, but in the middle of the range */
        recording.column[COLUMN_DRIVE][k] = 50.0 + 49.0 * sin(1e-7 * (double)(k - 10000) * (double)(k - 10000));
    }
    excerpt(&recording, 1, 4000);
    double range[2];
    recordings_range(&recording, 1, COLUMN_DRIVE, range);
    TEST_ASSERT_EQUAL_DOUBLE(-60.0, range[0]);
}

/* No window of the samples sees the range, so these become means: of as few as will do. */
static void test_means_of_a_slow_drive(void) {
    make(&recording, 64000, 16000);
    recording.masked = allocate(64000, 1);
    recording.masked[9] = 1;
    recording.held = true;
    recording_add_extra(&recording, "lamp", "", "", recording.column[COLUMN_DISPLACEMENT]);
    excerpt(&recording, 1, 4000);
    TEST_ASSERT_EQUAL_UINT64(4000, recording.samples);
    TEST_ASSERT_EQUAL_UINT64(2, excerpt_mean_of(&recording)); /* half a period is 8000 */
    TEST_ASSERT_EQUAL_DOUBLE(0.5 * rate_hz, recording.sample_rate_hz);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0 + 0.5 / rate_hz, recording_time(&recording, 0.0));
    for (size_t k = 0; k < 4000; k++) {
        TEST_ASSERT_EQUAL_DOUBLE(2.0 * (double)k + 0.5, recording.column[COLUMN_DISPLACEMENT][k]);
        TEST_ASSERT_EQUAL_DOUBLE(2.0 * (double)k + 0.5, recording.extra[0].value[k]);
        TEST_ASSERT_EQUAL_UINT8(k == 4, recording.masked[k]);
    }
    TEST_ASSERT_FALSE(recording.held); /* means of held values are none */
    char text[EXCERPT_LINE];
    TEST_ASSERT_TRUE(excerpt_text(&recording, text));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "8000 of 64000 samples"), text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "quicker than 0.002 s is not seen"), text);
}

/* What a short one does not need goes to the long one. */
static void test_shares(void) {
    recording_t both[2];
    make(&both[0], 1000, 400);
    make(&both[1], 90000, 400);
    excerpt(both, 2, 10000);
    TEST_ASSERT_NULL(both[0].whole);
    TEST_ASSERT_EQUAL_UINT64(1000, both[0].samples);
    TEST_ASSERT_EQUAL_UINT64(9000, both[1].samples);
    recording_free(&both[0]);
    recording_free(&both[1]);
}

/* A drive that never moves has no states to tell windows by. */
static void test_drive_at_rest(void) {
    make(&recording, 9000, 400);
    for (size_t k = 0; k < 9000; k++) {
        recording.column[COLUMN_DRIVE][k] = 5.0;
    }
    excerpt(&recording, 1, 1001);
    expect_window(&recording, 0, 1001);
}

/* What every way to ask goes through. */
static void test_a_run_uses_no_more(void) {
    const size_t most = (size_t)threshold.most_samples;
    diagnosis_run_t run;
    make(&recording, 3 * most, 400);
    progress_cancel(true);
    TEST_ASSERT_FALSE(diagnosis_run(NULL, &recording, 1, 0, &run, &failure));
    TEST_ASSERT_EQUAL_UINT64(most, recording.samples);
    TEST_ASSERT_EQUAL_UINT64(3 * most, recording.whole->samples);
}

/* As many as the caller says, and not so few that nothing can be said. */
static void test_a_run_uses_what_it_is_given(void) {
    diagnosis_run_t run;
    recording_t both[2];
    make(&both[0], 9000, 400);
    make(&both[1], 1500, 400);
    TEST_ASSERT_FALSE(diagnosis_run(NULL, both, 2, 2 * DIAGNOSIS_LEAST_SAMPLES - 1, &run, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "1999 of the samples: it takes 1000 of each"), failure.text);
    TEST_ASSERT_EQUAL_UINT64(9000, both[0].samples);
    progress_cancel(true);
    TEST_ASSERT_FALSE(diagnosis_run(NULL, both, 2, 5000, &run, &failure));
    TEST_ASSERT_EQUAL_UINT64(3500, both[0].samples);
    TEST_ASSERT_EQUAL_UINT64(1500, both[1].samples);
    recording_free(&both[0]);
    recording_free(&both[1]);
}

/* Windows of what is longer than its share, fitted and held out by themselves; all samples where one sees no end. */
static void test_windows_of_several(void) {
    static const double weights[] = {0.05, 0.03}, thresholds[] = {5};
    recording_t both[2];
    samples_t all;
    windows_t windows;
    model_t bank;
    make_bank_model(&bank, rate_hz, 1.0, 1, weights, thresholds);
    make(&both[0], 30000, 400);
    make(&both[1], 3000, 400);
    TEST_ASSERT_TRUE_MESSAGE(samples_open(&all, &bank, both, 2, &failure), failure.text);
    windows_open(&windows, &all, &bank, 10000);
    TEST_ASSERT_EQUAL_UINT64(5000 + 3000, windows.samples->all);
    TEST_ASSERT_TRUE(windows.samples->fitted > 4000 && windows.samples->held > 2000);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, windows.samples->recordings[0].column[COLUMN_DISPLACEMENT][0]); /* the first one */
    windows_close(&windows);
    windows_open(&windows, &all, &bank, 33000);
    TEST_ASSERT_EQUAL_PTR(&all, windows.samples);
    windows_close(&windows);
    for (size_t k = 0; k < both[0].samples; k++) {
        both[0].column[COLUMN_DRIVE][k] = 100.0 * (double)k / 30000.0;
    }
    windows_open(&windows, &all, &bank, 10000);
    TEST_ASSERT_EQUAL_PTR(&all, windows.samples);
    windows_close(&windows);
    samples_close(&all);
    recording_free(&both[0]);
    recording_free(&both[1]);
    model_free(&bank);
}

static double peak_mb(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return (double)usage.ru_maxrss / 1024.0;
}

/* A bank under triangles of many sizes, with so many samples a line, and 0.01 um of noise. */
static void make_noisy(const model_t *bank, size_t samples, size_t line, random_t *rng) {
    static const double corner[] = {0, 100, 10, 60, 20, 100, 0, 90, 20, 70, 10, 50};
    recording_create(&recording, "long.csv", rate_hz, samples);
    fill_lines(recording.column[COLUMN_DRIVE], samples, corner, sizeof corner / sizeof corner[0], line);
    simulate_into(&recording, bank, 1);
    for (size_t k = 0; k < samples; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] += 0.01 * random_normal(rng);
    }
}

/* Whether drive and displacement are exchanged is seen in as much as a diagnosis uses; 170 bytes for each sample
 * of the whole were taken once. */
static void test_columns_of_a_long_one(void) {
    enum { SAMPLES = 2000000 };
    static const double weights[] = {0.05, 0.03, 0.03, 0.03}, thresholds[] = {5, 15, 30};
    model_t bank;
    random_t rng = random_start("columns", 20261128);
    make_bank_model(&bank, rate_hz, 1.0, 3, weights, thresholds);
    make_noisy(&bank, SAMPLES, 500, &rng);
    const double before_mb = peak_mb();
    TEST_ASSERT_TRUE_MESSAGE(exchanged_refuse(&recording, 1, NULL, &failure), failure.text);
    double *const drive = recording.column[COLUMN_DRIVE];
    recording.column[COLUMN_DRIVE] = recording.column[COLUMN_DISPLACEMENT];
    recording.column[COLUMN_DISPLACEMENT] = drive;
    TEST_ASSERT_FALSE(exchanged_refuse(&recording, 1, NULL, &failure));
    const double taken_mb = peak_mb() - before_mb;
    printf("whether columns of %d samples are exchanged took %.0f MB\n", SAMPLES, taken_mb);
    TEST_ASSERT_TRUE(taken_mb < 150.0); /* 48 were measured */
    model_free(&bank);
}

/* The bank is known and complete in the window. Behind it the position is 3 um off: what is delivered is the error of
 * the whole. 2e6 samples used at once would take 5 GB; what is used takes some 2.8 kB a sample. The whole itself, the
 * simulation of it and what the program is anyway are the rest. */
static void test_a_long_one_takes_little_memory(void) {
    enum { SAMPLES = 2000000, USED = 3000 };
    static const double weights[] = {0.09, 0.01, 0.008}, thresholds[] = {5, 20};
    model_t bank;
    answer_t answer;
    random_t rng = random_start("excerpt", 20261125);
    make_bank_model(&bank, rate_hz, 1.0, 2, weights, thresholds);
    make_noisy(&bank, SAMPLES, 40, &rng);
    for (size_t k = SAMPLES / 2 + 1; k < SAMPLES; k++) {
        recording.column[COLUMN_DISPLACEMENT][k] += 3.0;
    }
    excerpt(&recording, 1, USED);
    const double before_mb = peak_mb();
    TEST_ASSERT_TRUE_MESSAGE(diagnose(&bank, &recording, 1, &answer, &failure), failure.text);
    const double taken_mb = peak_mb() - before_mb;
    printf("a diagnosis of %d of %d samples took %.0f MB\n", USED, SAMPLES, taken_mb);
    TEST_ASSERT_TRUE(taken_mb < 100.0); /* 9 were measured */
    TEST_ASSERT_EQUAL(NOTHING_MISSING, answer.verdict);
    TEST_ASSERT_EQUAL_UINT64(0, answer.findings);
    /* Half of it 3 um off: 2.12 um rms of some 13 um. */
    double range[2];
    values_range(recording.whole->column[COLUMN_DISPLACEMENT], SAMPLES, range);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 100.0 * 3.0 * sqrt(0.5) / (range[1] - range[0]), answer.delivered_percent);
    TEST_ASSERT_TRUE(answer.nrmse_percent < 0.2);
    answer_free(&answer);
    model_free(&bank);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_columns_of_a_long_one); /* first: a peak of another would hide its own */
    RUN_TEST(test_leaves_short_ones_alone);
    RUN_TEST(test_takes_the_first_of_equal_windows);
    RUN_TEST(test_goes_where_the_drive_does_most);
    RUN_TEST(test_sees_both_ends);
    RUN_TEST(test_means_of_a_slow_drive);
    RUN_TEST(test_shares);
    RUN_TEST(test_drive_at_rest);
    RUN_TEST(test_windows_of_several);
    RUN_TEST(test_a_run_uses_no_more);
    RUN_TEST(test_a_run_uses_what_it_is_given);
    RUN_TEST(test_a_long_one_takes_little_memory);
    return UNITY_END();
}
