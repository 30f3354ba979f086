/* SPDX-License-Identifier: MIT */
#include "random.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

random_t random_start(const char *test, uint64_t fixed_seed) {
    const char *text = getenv("HYST_TEST_SEED");
    random_t random = {text != NULL ? strtoull(text, NULL, 0) : fixed_seed};
    printf("%s: HYST_TEST_SEED=%" PRIu64 "\n", test, random.state);
    return random;
}

uint64_t random_bits(random_t *random) {
    uint64_t z = (random->state += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
}

int32_t random_q31(random_t *random) {
    return (int32_t)((int64_t)(random_bits(random) >> 32) + INT32_MIN);
}

int32_t random_between(random_t *random, int32_t low, int32_t high) {
    const uint64_t span = (uint64_t)((int64_t)high - low) + 1U;
    return (int32_t)(low + (int64_t)(random_bits(random) % span));
}

double random_unit(random_t *random) {
    return (double)(random_bits(random) >> 11) * 0x1p-53;
}

double random_normal(random_t *random) { /* Box and Muller */
    const double radius = sqrt(-2.0 * log(1.0 - random_unit(random)));
    return radius * cos(6.283185307179586 * random_unit(random));
}
