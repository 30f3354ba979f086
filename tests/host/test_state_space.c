/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Linear filters of few states: from a response, behind each other, and for many columns at once. */
#include "base/failure.h"
#include "numerics/state_space.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 500 };

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* A mode of a frequency (radians a sample) and a damping, sampled: a pair of poles and a gain at rest of 1. */
static state_space_t mode(double frequency, double damping) {
    const double radius = exp(-damping * frequency), turn = frequency * sqrt(1.0 - damping * damping);
    const double a1 = 2.0 * radius * cos(turn), a2 = -radius * radius;
    return (state_space_t){.states = 2, .a = {{a1, a2}, {1.0, 0.0}}, .b = {1.0, 0.0}, .c = {1.0 - a1 - a2, 0.0}};
}

/* Halfway between a sample and the next one. */
static state_space_t half_a_sample_early(void) {
    return (state_space_t){.states = 1, .ahead = 1, .b = {1.0}, .c = {0.5}, .d = 0.5};
}

/* What the filter's response says, sample by sample: value is constant before its first sample and behind its last. */
static void convolve(const double *response, size_t length, size_t ahead, const double *value, double *filtered) {
    for (size_t k = 0; k < SAMPLES; k++) {
        filtered[k] = 0.0;
        for (size_t i = 0; i < length; i++) {
            const size_t at = k + ahead < i ? 0 : k + ahead - i;
            filtered[k] += response[i] * value[at < SAMPLES ? at : SAMPLES - 1];
        }
    }
}

static void random_column(double *value) {
    for (size_t k = 0; k < SAMPLES; k++) {
        value[k] = 3.0 + random_normal(&rng);
    }
}

/* response[0] is the first that the impulse causes, `ahead` samples before it. */
static void respond(const state_space_t *filter, double *response, size_t length) {
    double *value = allocate(length + filter->ahead, sizeof(double));
    value[2 * filter->ahead] = 1.0; /* the samples before are at rest */
    state_space_column(filter, value, length + filter->ahead);
    memcpy(response, value + filter->ahead, length * sizeof(double));
    free(value);
}

static void test_a_column_is_convolved_with_the_response(void) {
    enum { LENGTH = 4000 };
    static double response[LENGTH], value[SAMPLES], wanted[SAMPLES];
    state_space_t early = half_a_sample_early(), ring = mode(0.3, 0.02), filter;
    TEST_ASSERT_TRUE(state_space_cascade(&early, &ring, &filter));
    TEST_ASSERT_EQUAL_UINT64(1, filter.ahead);
    respond(&filter, response, LENGTH);
    random_column(value);
    convolve(response, LENGTH, filter.ahead, value, wanted);
    state_space_column(&filter, value, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, wanted[k],
                                  value[k]); /* exp(-0.02 0.3 4000) of the response is cut off: 4e-11 */
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, state_space_gain_at_rest(&filter));
}

static void test_one_behind_the_other(void) {
    static double one[SAMPLES], other[SAMPLES];
    const state_space_t first = mode(0.4, 0.1), second = mode(1.1, 0.05);
    state_space_t both, ignored, large = {.states = STATE_SPACE_MOST - 1};
    TEST_ASSERT_TRUE(state_space_cascade(&first, &second, &both));
    random_column(one);
    memcpy(other, one, sizeof other);
    state_space_column(&first, one, SAMPLES);
    state_space_column(&second, one, SAMPLES);
    state_space_column(&both, other, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, one[k], other[k]);
    }
    TEST_ASSERT_FALSE(state_space_cascade(&first, &large, &ignored));
    const state_space_t far = {.ahead = STATE_SPACE_AHEAD}, early = half_a_sample_early();
    TEST_ASSERT_FALSE(state_space_cascade(&far, &early, &ignored));
}

/* Two modes and half a sample ahead, from the response alone: 5 states. */
static void test_a_response_is_realised(void) {
    enum { LENGTH = 3000 };
    static double response[LENGTH], wanted[SAMPLES], value[SAMPLES];
    const state_space_t low = mode(0.126, 0.02), high = mode(0.9, 0.01), early = half_a_sample_early();
    state_space_t modes, all, found;
    TEST_ASSERT_TRUE(state_space_cascade(&low, &high, &modes));
    TEST_ASSERT_TRUE(state_space_cascade(&early, &modes, &all));
    respond(&all, response, LENGTH);
    /* Up to 1e-6 of the step response. */
    TEST_ASSERT_TRUE(state_space_realise(response, LENGTH, all.ahead, 10, 1e-6, &found) < 1e-6);
    TEST_ASSERT_TRUE(found.states <= 5);
    TEST_ASSERT_EQUAL_UINT64(1, found.ahead);
    random_column(value);
    memcpy(wanted, value, sizeof wanted);
    state_space_column(&all, wanted, SAMPLES);
    state_space_column(&found, value, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        /* Steps of up to 8 each time: 500 of them at 1e-6 of the largest step response, which is 2. */
        TEST_ASSERT_DOUBLE_WITHIN(8e-3, wanted[k], value[k]);
    }
    /* Two states too few are reported. */
    TEST_ASSERT_TRUE(state_space_realise(response, LENGTH, all.ahead, 3, 1e-6, &found) > 1e-3);
}

/* What grows is nothing that a recording passes through, and a response without anything has no filter. */
static void test_what_cannot_be_realised(void) {
    enum { LENGTH = 4096 };
    static double response[LENGTH];
    state_space_t found;
    random_t noise = rng;
    for (size_t k = 0; k < LENGTH; k++) {
        response[k] = random_normal(&noise);
    }
    TEST_ASSERT_TRUE(state_space_realise(response, LENGTH, 0, 10, 1e-6, &found) > 0.05);
    memset(response, 0, sizeof response);
    TEST_ASSERT_TRUE(isinf(state_space_realise(response, LENGTH, 0, 10, 1e-6, &found)));
    TEST_ASSERT_TRUE(isinf(state_space_realise(response, 0, 0, 10, 1e-6, &found)));
    response[0] = 2.0;
    TEST_ASSERT_EQUAL_DOUBLE(0.0, state_space_realise(response, 1, 0, 10, 1e-6, &found));
    TEST_ASSERT_EQUAL_DOUBLE(2.0, state_space_gain_at_rest(&found));
}

/* Many columns, block by block, with outputs at some of the rows, are the columns one by one. */
static void check_rows(const state_space_t *filter, size_t columns) {
    double *row = allocate(SAMPLES * columns, sizeof(double)), *filtered = allocate(SAMPLES * columns, sizeof(double)),
           *column = allocate(SAMPLES * columns, sizeof(double));
    for (size_t j = 0; j < columns; j++) {
        random_column(column + j * SAMPLES);
        for (size_t k = 0; k < SAMPLES; k++) {
            row[k * columns + j] = column[j * SAMPLES + k];
        }
        state_space_column(filter, column + j * SAMPLES, SAMPLES);
    }
    state_space_rows_t filtering;
    state_space_rows_open(&filtering, filter, columns);
    for (size_t from = 0; from < SAMPLES; from += STATE_SPACE_ROWS) {
        size_t taken[STATE_SPACE_ROWS], count = 0;
        const size_t rows = SAMPLES - from < STATE_SPACE_ROWS ? SAMPLES - from : STATE_SPACE_ROWS;
        for (size_t k = 0; k < rows; k += 1 + from % 3) {
            taken[count++] = k;
        }
        state_space_rows(&filtering, row + from * columns, rows, from == 0, taken, count, filtered);
        for (size_t t = 0; t < count; t++) {
            for (size_t j = 0; j < columns; j++) {
                TEST_ASSERT_DOUBLE_WITHIN(1e-11, column[j * SAMPLES + from + taken[t]], filtered[t * columns + j]);
            }
        }
    }
    state_space_rows_close(&filtering);
    free(row);
    free(filtered);
    free(column);
}

static void test_rows_are_the_columns(void) {
    const state_space_t ring = mode(0.3, 0.01), identity = state_space_identity();
    check_rows(&ring, 1);
    check_rows(&ring, 7);
    check_rows(&identity, 3);
    TEST_ASSERT_TRUE(state_space_is_identity(&identity));
    TEST_ASSERT_FALSE(state_space_is_identity(&ring));
}

int main(void) {
    rng = random_start("state_space", 20261126);
    UNITY_BEGIN();
    RUN_TEST(test_a_column_is_convolved_with_the_response);
    RUN_TEST(test_one_behind_the_other);
    RUN_TEST(test_a_response_is_realised);
    RUN_TEST(test_what_cannot_be_realised);
    RUN_TEST(test_rows_are_the_columns);
    return UNITY_END();
}
