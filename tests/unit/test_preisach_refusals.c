/* SPDX-License-Identifier: MIT */
/* The Preisach validator: what it refuses, that it points at the culprit, and that it is right to. */
#include "preisach_models.h"
#include "unity.h"
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static hyst_preisach_status_t build(const preisach_arguments_t *a, uint32_t *element) {
    hyst_preisach_t model;
    memset(&model, 0x5A, sizeof model);
    const hyst_preisach_t untouched = model;
    const hyst_preisach_status_t status = hyst_preisach_build(&model, a->intervals, a->offset, a->everett, element);
    if (status != HYST_PREISACH_OK) {
        TEST_ASSERT_EQUAL_MEMORY(&untouched, &model, sizeof model);
    }
    return status;
}

static void test_intervals(void) {
    preisach_arguments_t a = preisach_smooth(HYST_PREISACH_MAX_INTERVALS, 0.5, 0.1);
    static const uint32_t wrong[] = {0, HYST_PREISACH_MAX_INTERVALS + 1U, UINT32_MAX};
    for (size_t k = 0; k < sizeof wrong / sizeof wrong[0]; k++) {
        uint32_t element = 77;
        a.intervals = wrong[k];
        TEST_ASSERT_EQUAL_INT(HYST_PREISACH_INTERVALS_OUT_OF_RANGE, build(&a, &element));
        TEST_ASSERT_EQUAL_UINT32(0, element);
    }
}

/* One interval: the element is both steps. The bounds themselves are accepted, one unit beyond is not. */
static void test_bounds_to_the_unit(void) {
    for (uint32_t n = 1; n <= HYST_PREISACH_MAX_INTERVALS; n++) {
        preisach_arguments_t a = {.intervals = n};
        for (int steepest = 0; steepest < 2; steepest++) {
            const int64_t step = steepest != 0 ? preisach_largest_step(n) : preisach_least_step(n);
            for (uint32_t i = 1; i <= n; i++) {
                for (uint32_t j = 0; j < i; j++) {
                    const int64_t value = step * (i - j);
                    a.everett[i * (i - 1U) / 2U + j] = (hyst_q28_t)(value > INT32_MAX ? INT32_MAX : value);
                }
            }
            uint32_t element = 0;
            TEST_ASSERT_EQUAL_INT(HYST_PREISACH_OK, build(&a, &element));
            const uint32_t corner = HYST_PREISACH_ELEMENTS(n) - n; /* E(N, 0) */
            if (steepest == 0) {
                a.everett[corner]--;
                TEST_ASSERT_EQUAL_INT(HYST_PREISACH_RISING_TOO_FLAT, build(&a, &element));
                TEST_ASSERT_EQUAL_UINT32(corner, element);
            } else if (a.everett[corner] < INT32_MAX) {
                a.everett[corner]++;
                TEST_ASSERT_EQUAL_INT(HYST_PREISACH_TOO_STEEP, build(&a, &element));
                TEST_ASSERT_EQUAL_UINT32(corner, element);
            }
        }
    }
}

/* E of the straight line at every pair of levels, but for one row or column that is pulled down by `drop` steps. */
static preisach_arguments_t dented(uint32_t intervals, uint32_t i, uint32_t j, int32_t drop) {
    preisach_arguments_t a = preisach_smooth(intervals, 0.5, 0.0);
    a.everett[i * (i - 1U) / 2U + j] -= drop;
    return a;
}

/*
 * An element that is too small by itself makes a rising or a falling branch fall, and the definition shows it: the
 * branch is the one that begins at level j (rising) or i (falling). Status and element are those of the first bad step.
 */
static void test_refused_tables_really_fall(void) {
    static preisach_reference_t reference;
    for (int run = 0; run < 500; run++) {
        const uint32_t n = 2U + (uint32_t)(random_bits(&rng) % (HYST_PREISACH_MAX_INTERVALS - 1U));
        const uint32_t i = 2U + (uint32_t)(random_bits(&rng) % (n - 1U));
        const uint32_t j = (uint32_t)(random_bits(&rng) % (i - 1U)); /* not next to the diagonal */
        const int32_t step = HYST_Q28_ONE / (int32_t)n;              /* of the straight line: slope 0.5 */
        const preisach_arguments_t a = dented(n, i, j, 2 * step);
        uint32_t element = 0;
        TEST_ASSERT_EQUAL_INT(HYST_PREISACH_RISING_TOO_FLAT, build(&a, &element));
        TEST_ASSERT_EQUAL_UINT32(i * (i - 1U) / 2U + j, element);
        const long double width = 2.0L / n;
        preisach_reference_begin(&reference, &a);
        (void)preisach_reference_forward(&reference, 1.0L);
        (void)preisach_reference_forward(&reference, -1.0L + j * width);
        const long double before = preisach_reference_forward(&reference, -1.0L + (i - 1U) * width);
        TEST_ASSERT_TRUE(preisach_reference_forward(&reference, -1.0L + i * width) < before);
        /* The falling branch from level i: between levels j + 1 and j. */
        preisach_reference_begin(&reference, &a);
        (void)preisach_reference_forward(&reference, -1.0L + i * width);
        const long double above = preisach_reference_forward(&reference, -1.0L + (j + 1U) * width);
        TEST_ASSERT_TRUE(preisach_reference_forward(&reference, -1.0L + j * width) > above);
    }
}

/* A table whose rising steps are good and one falling step is not. */
static void test_falling_alone(void) {
    const int32_t step = HYST_Q28_ONE / 8;
    preisach_arguments_t a = {.intervals = 2, .everett = {step, 2 * step, 2 * step}};
    uint32_t element = 0;
    TEST_ASSERT_EQUAL_INT(HYST_PREISACH_FALLING_TOO_FLAT, build(&a, &element)); /* E(2,0) - E(2,1) = 0 */
    TEST_ASSERT_EQUAL_UINT32(1, element);
    a.everett[1] += preisach_least_step(2);
    TEST_ASSERT_EQUAL_INT(HYST_PREISACH_OK, build(&a, &element));
}

/* Accepted or refused exactly as the differences say, for tables with random damage; nothing overflows. */
static void test_agrees_with_all_differences(void) {
    int refused = 0;
    for (int run = 0; run < 20000; run++) {
        preisach_arguments_t a =
            preisach_random(&rng, 1U + (uint32_t)(random_bits(&rng) % HYST_PREISACH_MAX_INTERVALS));
        const uint32_t where = (uint32_t)(random_bits(&rng) % HYST_PREISACH_ELEMENTS(a.intervals));
        static const int32_t extremes[] = {INT32_MIN, INT32_MIN + 1, -1, 0, 1, INT32_MAX};
        a.everett[where] = run % 3 == 0 ? extremes[random_bits(&rng) % 6U]
                                        : hyst_add(a.everett[where], random_q31(&rng) >> (random_bits(&rng) % 31U));
        bool good = true;
        for (uint32_t i = 1; i <= a.intervals; i++) {
            for (uint32_t j = 0; j < i; j++) {
                const int64_t here = a.everett[i * (i - 1U) / 2U + j];
                const int64_t below = j + 1U < i ? a.everett[(i - 1U) * (i - 2U) / 2U + j] : 0;
                const int64_t beside = j + 1U < i ? a.everett[i * (i - 1U) / 2U + j + 1U] : 0;
                const int64_t least = preisach_least_step(a.intervals);
                const int64_t most = preisach_largest_step(a.intervals);
                good = good && here - below >= least && here - below <= most && here - beside >= least &&
                       here - beside <= most;
            }
        }
        uint32_t element = 0;
        TEST_ASSERT_EQUAL_INT(good, build(&a, &element) == HYST_PREISACH_OK);
        TEST_ASSERT_TRUE(element < HYST_PREISACH_ELEMENTS(a.intervals));
        refused += good ? 0 : 1;
    }
    TEST_ASSERT_TRUE(refused > 1000 && refused < 19000);
}

int main(void) {
    rng = random_start("test_preisach_refusals", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_intervals);
    RUN_TEST(test_bounds_to_the_unit);
    RUN_TEST(test_refused_tables_really_fall);
    RUN_TEST(test_falling_alone);
    RUN_TEST(test_agrees_with_all_differences);
    return UNITY_END();
}
