/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which of OpenBLAS' code a process should have. */
#include "numerics/blas.h"
#include "unity.h"
#include <stdlib.h>

void setUp(void) {
}
void tearDown(void) {
}

static void test_only_the_fallback_is_replaced_and_only_where_it_can_run(void) {
    TEST_ASSERT_EQUAL_STRING("Haswell", blas_better_than("Prescott", 1));
    TEST_ASSERT_NULL(blas_better_than("Prescott", 0));
    const char *const known[] = {"Haswell", "SkylakeX", "Zen", "Sandybridge"};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        TEST_ASSERT_NULL(blas_better_than(known[i], 1));
    }
}

static void test_what_the_user_chose_stays(void) {
    TEST_ASSERT_EQUAL(0, setenv("OPENBLAS_CORETYPE", "Prescott", 1));
    TEST_ASSERT_NULL(blas_better_code());
}

static void test_threads_are_given_back(void) {
    const int before = blas_threads(1);
    TEST_ASSERT_GREATER_OR_EQUAL(1, before);
    TEST_ASSERT_EQUAL(1, blas_threads(before));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_only_the_fallback_is_replaced_and_only_where_it_can_run);
    RUN_TEST(test_what_the_user_chose_stays);
    RUN_TEST(test_threads_are_given_back);
    return UNITY_END();
}
