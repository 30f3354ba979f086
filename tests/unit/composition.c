/* SPDX-License-Identifier: MIT */
#include "composition.h"
#include "unity.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

uint64_t composition_samples(void) {
    const char *text = getenv("HYST_COMPOSITION_SAMPLES");
    return text != NULL ? strtoull(text, NULL, 10) : UINT64_C(10000000);
}

void composition_add(composition_count_t *total, hyst_q31_t wanted, hyst_q31_t drive, bool saturated, hyst_q31_t got,
                     int64_t bound) {
    if (saturated) {
        TEST_ASSERT_TRUE((drive == INT32_MAX && got <= wanted) || (drive == INT32_MIN && got >= wanted));
        total->out_of_reach++;
        return;
    }
    const int64_t error = llabs((int64_t)got - wanted);
    TEST_ASSERT_TRUE_MESSAGE(error <= bound, "composition error above its bound");
    total->worst = error > total->worst ? error : total->worst;
    total->composed++;
}

void composition_report(const composition_count_t *total) {
    printf("composition: %" PRIu64 " samples (and %" PRIu64 " out of reach), worst error %" PRId64 " * 2^-31\n",
           total->composed, total->out_of_reach, total->worst);
    TEST_ASSERT_TRUE(total->out_of_reach > 0);
}
