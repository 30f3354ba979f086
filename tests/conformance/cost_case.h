/* SPDX-License-Identifier: MIT */
/** What the cost programs have in common: the counter, the models that are measured, and the lines that are printed. */
#ifndef COST_CASE_H
#define COST_CASE_H

#include "conformance.h"

typedef struct {
    uint32_t worst;
    uint64_t sum;
    uint32_t calls;
} cost_t;

/** Instructions since some point in time, and what looking twice costs with nothing in between. */
uint32_t cost_counter(void);
uint32_t cost_of_looking(void);
void cost_add(cost_t *cost, uint32_t taken);

/** Kinds of hysteresis. */
typedef enum { FIXED_THRESHOLDS, RATE_DEPENDENT, PREISACH, BOUC_WEN, MODIFIED_PLAY } cost_kind_t;

/** A hysteresis of that kind in place of the one that is there. `size`: operators, intervals, cells or divisions. */
void cost_generate(generator_t *generator, hyst_parameters_t *parameters, cost_kind_t kind, uint32_t size);

/** Thresholds at equal distances up to half the range: reversals of ever smaller size leave one more operator behind
 * each. */
void cost_spread_thresholds(hyst_parameters_t *parameters);

/** A line of the table. */
typedef struct {
    cost_kind_t kind;
    uint32_t size, sections, cells;
    bool extras; /**< drive curve, reference curve and inertia section: all of them, or none */
} cost_case_t;

extern const cost_case_t cost_cases[];
extern const unsigned cost_case_count;

/** Each line is so many random models. */
#define COST_MODELS 16U

/** Histories that the models take turns in. */
typedef enum {
    COST_ANYTHING, /**< ramps, steps of one unit, jumps, both ends of the range */
    COST_NESTED,   /**< ever smaller reversals, broken by jumps */
    COST_STAIRS,   /**< ever smaller reversals on evenly spread thresholds down to a random depth, then a jump back */
    COST_LIMITED,  /**< the same with drive limits that the jumps meet */
    COST_HISTORIES
} cost_history_t;

/** Model number `model` of a line. */
void cost_case_parameters(generator_t *generator, hyst_parameters_t *parameters, const cost_case_t *line,
                          unsigned model);
cost_history_t cost_history(unsigned model);

/** References of a history. Starts at all zero. */
typedef struct {
    excitation_t excitation;
    uint32_t depth; /**< of the stairs, samples left */
    hyst_q31_t value;
} cost_reference_t;
hyst_q31_t cost_reference(generator_t *generator, cost_reference_t *reference, cost_history_t history, unsigned k);

/** "play operators, rate-dependent 16 4 0 extras": the line's name in the output and in budget.txt, without blanks. */
void cost_print_case(const cost_case_t *line);
void cost_print_number(uint32_t number);
void cost_print(const cost_t *cost);

#endif
