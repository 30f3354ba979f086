/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where a plain model takes the place of the one that the search went on with, all that is said is of the plain one. */
#include "chain/catalogue.h"
#include "diagnosis/diagnose.h"
#include "support.h"
#include "unity.h"
#include <stdio.h>
#include <string.h>

enum { SAMPLES = 12000, HELD = 40, RUNS = 4 };
static const double rate_hz = 2000.0, noise_um = 0.005;
static recording_t recording;
static answer_t diagnosis;
static failure_t failure;
static random_t rng;

void setUp(void) {
}

void tearDown(void) {
    recording_free(&recording);
}

/* Two levels at random, and a position in proportion: any hysteresis may be the first shape, and plays may deliver
 * less. */
static void record(void) {
    double u = 20.0;
    recording_free(&recording);
    recording_create(&recording, "two_levels.csv", rate_hz, SAMPLES);
    for (size_t k = 0; k < SAMPLES; k++) {
        u = k % HELD != 0 ? u : random_unit(&rng) < 0.5 ? 20.0 : 80.0;
        recording.column[COLUMN_DRIVE][k] = u;
        recording.column[COLUMN_DISPLACEMENT][k] = 1.0 + 0.25 * u + noise_um * random_normal(&rng);
    }
    recording.held = true;
}

static void test_no_equation_is_blamed_that_is_not_in_the_chain(void) {
    size_t plain = 0;
    for (size_t run = 0; run < RUNS; run++) {
        record();
        TEST_ASSERT_TRUE_MESSAGE(diagnose(NULL, &recording, 1, &diagnosis, &failure), failure.text);
        const block_t *hysteresis = diagnosis.model.block[0].block;
        plain += hysteresis == &block_prandtl_ishlinskii;
        for (size_t i = 0; i < diagnosis.unseen_count; i++) {
            const char *why = diagnosis.unseen[i].why;
            if (why != NULL && strstr(why, "has no thresholds") != NULL) {
                TEST_ASSERT_FALSE_MESSAGE(hysteresis->can_widen, hysteresis->name);
            }
        }
        answer_free(&diagnosis);
    }
    printf("%zu of %d have plays\n", plain, RUNS);
    TEST_ASSERT_TRUE(plain > 0);
}

int main(void) {
    rng = random_start("diagnose_plain", 5U);
    UNITY_BEGIN();
    RUN_TEST(test_no_equation_is_blamed_that_is_not_in_the_chain);
    return UNITY_END();
}
