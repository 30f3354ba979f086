/* SPDX-License-Identifier: MIT */
/**
 * Lives in which everything happens at once: late and missed samples, readings out of their limits, a lost sensor, a
 * supply that sags, flash that fails or is cut, memory that changes, restarts, a host that dies, a main loop that
 * hangs, an echo, garbage and a second master on the line, while a master uploads images, arms, moves, changes limits
 * and stores. Whatever it is, some rules hold in every sample.
 *
 * Life number n of a run that begins with a seed is the life of seed + n: a run of one life with that seed repeats it.
 */
#ifndef TESTS_LIVES_H
#define TESTS_LIVES_H

#include <stdint.h>

typedef enum {
    RULE_STEP,
    RULE_RANGE,
    RULE_STAGE,
    RULE_STATES,
    RULE_LATCH,
    RULE_RAMP,
    RULE_SILENCE,
    RULE_CAUSE,
    RULE_STORE,
    RULE_LINE,
    RULES
} rule_t;

typedef struct {
    const char *fault, *expected;
} rule_text_t;

extern const rule_text_t rule_text[RULES];

/** What may go wrong, each for a time. */
typedef enum {
    LATE,
    MISSED,
    CONVERTER,
    SUPPLY_SAGS,
    TEMPERATURE,
    SUPPLY,
    HIGH_VOLTAGE,
    SENSOR,
    HOST_DIES,
    MAIN_LOOP_HANGS,
    GARBAGE,
    SECOND_MASTER,
    ECHO,
    MEMORY,
    RESTART,
    POWER_CUT,
    FLASH,
    KINDS
} kind_t;

extern const struct kind {
    const char *name;
    int32_t longest; /**< samples */
} kinds[KINDS];

typedef struct {
    unsigned long lives, samples;
    unsigned long held[RULES]; /**< lives in which it held in every sample */
} lives_t;

/** Prints the seed of the first lives that break a rule, which rule, and in which sample. Then what was met: how often
 * each kind of fault, state, trip and store; with a hundred lives or more the test fails on one that was not. */
lives_t lives_run(uint64_t seed, unsigned long lives);

#endif
