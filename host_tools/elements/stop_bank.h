/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A weighted sum of stop operators of the position, as the force (in volts) of a hysteretic spring:
 *
 *     H[x] = k x + sum w_i e_i,      e_i = x - z_i,      z_i = play of x with threshold r_i
 *
 * and its exact inverse. docs/MODELS.md, section 11. The memory is that of the plays z_i, and nested in the same way.
 */
#ifndef STOP_BANK_H
#define STOP_BANK_H

#include "chain/parameter_rows.h"
#include "elements/play_curve.h"

typedef struct {
    size_t operators;
    double stiffness;        /**< k, V/um */
    const double *weight;    /**< operators, V/um */
    const double *threshold; /**< operators, um, rising, > 0 */
} stop_bank_t;

/** Whether H is strictly increasing: k and every k + w_i + ... + w_n are positive. Otherwise it has no inverse. */
bool stop_bank_rises(const stop_bank_t *bank);

/**
 * Solves (further + k) x + sum w_i e_i = value for x, exactly, in at most `operators` steps. further >= 0. memory: the
 * z_i before x, nested.
 */
double stop_bank_solve(const stop_bank_t *bank, const double *memory, double further, double value);

/** Moves the memory to x. Each element ends within its threshold of x. */
void stop_bank_advance(const stop_bank_t *bank, double *memory, double x);

/**
 * The inverse of H as a sum of plays of the drive: weights um/V, thresholds V. play->weight (operators + 1) and
 * play->threshold (operators) are allocated by the caller. H must be strictly increasing.
 */
void stop_bank_to_play(const stop_bank_t *bank, play_bank_t *play);

/** Converts a memory of that inverse (z_i of the drive in V) into the memory of H (z_i of the position in um). */
void stop_bank_memory(const stop_bank_t *bank, const double *play_v, double *memory_um);

/* Shared by blocks with such a spring: their first four parameters and their checks. */
enum { STOP_OFFSET, STOP_WEIGHTS, STOP_THRESHOLDS, STOP_INITIAL_MEMORY, STOP_PARAMETERS };

#define STOP_PARAMETER_TABLE                                                                                           \
    {.name = "offset_v", .unit = "V", .low = -1e9, .high = 1e9, .text = "drive at position 0, demagnetised"},          \
        PARAMETER_WEIGHTS("V/um", "stiffness k of the position itself, then one a stop operator"),                     \
        PARAMETER_THRESHOLDS("thresholds_um", "um", "of the stop operators, strictly rising"),                         \
        PARAMETER_MEMORY("initial_memory_um", "um",                                                                    \
                         "position less stop output before the first sample; absent: demagnetised at 0 um")

/** The bank in such a block's parameters; it points into them. */
stop_bank_t stop_bank_of(const parameter_t *parameter);

/** A block's check: lengths, order, inverse. */
bool stop_bank_check(const parameter_t *parameter, failure_t *failure);

/** First member of such a block's state. Its arrays: weights, thresholds, initial memory, memory. */
typedef struct {
    double offset_v;
    stop_bank_t bank;
    const double *initial;
    double *memory;
} stop_spring_t;

/** Bytes after the state that stop_spring_open needs. */
size_t stop_spring_bytes(const parameter_t *parameter, const stage_setup_t *setup);
/** Copies the parameters into `array`, which has stop_spring_bytes. */
void stop_spring_open(stop_spring_t *spring, double *array, const parameter_t *parameter);
/** Sets the initial memory, then moves slowly to equilibrium with the drive. Returns that position. */
double stop_spring_settle(stop_spring_t *spring, double drive_v);

#endif
