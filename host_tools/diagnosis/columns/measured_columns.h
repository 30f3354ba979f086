/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What a model leaves, against what was measured beside drive and displacement: temperature, voltage, current
 * (recording.h). Of none of these does the model know anything.
 *
 *     e = displacement - simulation;   does e go with x?
 *
 * x is, by column:
 *
 * - temperature: as it is, or behind a first-order lag, because the actuator is warm later than the thermometer;
 * - voltage: how the simulated position would change if the hysteresis saw the measured voltage (offset and gain
 *   fitted) instead of the simulated one. The coefficient is 1 when the position follows the measured one, and counts
 *   from 0.5 to 2;
 * - current: what its equation does not explain (electrical.h).
 *
 * It *goes with it* when it passes the fast test (column_test.h); of all such tests of a diagnosis together one in 100
 * does so by chance. What passes only without the half waves, and explains 0.8 of what these do, *looks like* it: a
 * thermometer that does nothing but drift looks like every other drift.
 */
#ifndef MEASURED_COLUMNS_H
#define MEASURED_COLUMNS_H

#include "diagnosis/answer/answer.h"
#include "diagnosis/evidence/electrical.h"

struct state; /* state.h */

enum { MEASURED_MOST = 3 };

typedef enum { GOES_WITH_NOTHING, LOOKS_LIKE_IT, GOES_WITH_IT } relation_t;

typedef struct {
    relation_t relation;
    double coefficient, sigma; /**< um/K, um/A, of the voltage 1 */
    double lag_s;              /**< time constant of the lag behind the thermometer, 0: none */
    double share; /**< of the square of what is left on the held-out samples, whitened, beyond the nuisance subspace */
    double least; /**< coefficient from which on it would have gone with it; HUGE_VAL: it does not vary enough */
} column_relation_t;

typedef struct {
    column_t column;
    column_relation_t before; /**< what the baseline leaves */
    column_relation_t after;  /**< what the model with all findings leaves; as before when there are none */
} measured_column_t;

/** What the columns say of a finding. Blocks that they do not decide about have nothing here. */
typedef struct {
    /** Whose change is looked for in voltage and current: the finding's block, or amplifier_bandwidth with the numbers
     * of sensor_bandwidth; NULL: no block's. */
    const block_t *block;
    electrical_change_t voltage, current;
    /** Where what the baseline leaves goes with the temperature: how much of the finding stands beside that. */
    electrical_change_t beside_temperature;
} finding_columns_t;

typedef struct {
    size_t count; /**< columns that some recording has, those above */
    measured_column_t column[MEASURED_MOST];
    finding_columns_t finding[DIAGNOSIS_MOST_FINDINGS];
} measured_columns_t;

/** Empty when no recording has such a column. */
bool measured_columns(const answer_t *answer, measured_columns_t *measured, failure_t *failure);
/** Whether what the model leaves goes with one of them: then it is no function of the drive's path, even where the
 * operator's noise is slow enough to hold it, and no empirical term has to describe it. */
bool measured_columns_have_it(const answer_t *answer, bool *have_it, failure_t *failure);

/**
 * Whether the columns contradict a finding: a block of the electronics whose change neither voltage nor current shows
 * (but a delay may be behind them), or a block that the temperature explains (but thermal_drift may be just that).
 */
bool finding_contradicted(const finding_t *finding, const finding_columns_t *columns);

/** Takes out of an attempt the findings, the latest first, that the temperature explains. Without that column nothing
 * happens. */
bool temperature_settle(struct state *state);

#endif
