/* SPDX-License-Identifier: MIT */
/**
 * Random numbers for tests. Every test that uses them prints its seed; HYST_TEST_SEED=<number> replays a run.
 */
#ifndef TESTS_RANDOM_H
#define TESTS_RANDOM_H

#include <stdint.h>

typedef struct {
    uint64_t state;
} random_t;

/** Seeds from HYST_TEST_SEED, else from `fixed_seed`, and prints the seed with the test's name. */
random_t random_start(const char *test, uint64_t fixed_seed);

/** 64 bits (splitmix64). */
uint64_t random_bits(random_t *random);

/** Uniform over all of int32. */
int32_t random_q31(random_t *random);

/** Uniform integer in [low, high]. */
int32_t random_between(random_t *random, int32_t low, int32_t high);

/** Uniform in [0, 1). */
double random_unit(random_t *random);

/** Normal, mean 0, variance 1. */
double random_normal(random_t *random);

#endif
