/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The twin: a model in double precision that replaces the actuator between the two converters.
 *
 * A drive code holds the voltage for one sample period, which the model integrates in `substeps` equal parts; then the
 * position is converted to a code. Both converters have 16 bits over their range: code 0 is the low end, code 32768 the
 * middle.
 */
#ifndef TWIN_H
#define TWIN_H

#include "bench/converter_line.h"
#include "chain/model.h"

/** Blocks added to the model, and the converters. */
typedef struct {
    double sample_rate_hz; /**< of the converters */
    unsigned long substeps;
    double drive_range_v[2], position_range_um[2];
    double noise_um;                        /**< RMS; 0: none */
    double resonance_hz, resonance_damping; /**< resonance_hz 0: none */
    double load_hz, load_damping; /**< the mode from load_at_s on, in place of that one; load_hz 0: no load comes */
    double load_at_s;             /**< of the twin's own time, which its samples make */
    bool sags;                    /**< the supply: no voltage above sag_v from sag_at_s on */
    double sag_v, sag_at_s;
    unsigned long seed; /**< of the noise */
    bool real_time;     /**< pace the samples by the clock, else as fast as the bench takes them */
    const char *log;    /**< CSV recording of voltage and unconverted position, or NULL */
} twin_options_t;

typedef struct twin twin_t;

/** Starts at rest at 0 V, or at the end of the drive range that is nearest to it. NULL on failure. */
twin_t *twin_open(const model_t *model, const twin_options_t *options, failure_t *failure);

/** Code of the present position. */
uint16_t twin_position_code(const twin_t *twin);

/** What the power stage is supplied with now, in mV: as much as the end of the drive converter's range, until it sags
 * (then 1 mV at least). 0: that end is not above 0 V. */
uint32_t twin_supply_mv(const twin_t *twin);

/** One sample period with this drive code. */
void twin_step(twin_t *twin, uint16_t drive_code);

void twin_close(twin_t *twin);

/** Statistics of a run. */
typedef struct {
    unsigned long samples;
    double seconds; /**< of the clock, from the first drive code on */
} twin_run_t;

/**
 * Serves the line until its other end closes it, until a stop is requested, or until it fails (then false). Calls
 * ready(context) once, after the first drive code; ready may be NULL. Afterwards writes the log.
 */
bool twin_run(twin_t *twin, converter_line_t *line, void (*ready)(void *context), void *context, twin_run_t *run,
              failure_t *failure);

#endif
