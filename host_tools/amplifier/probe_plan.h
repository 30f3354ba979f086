/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The signal of `record --probe`: one polygon of drive against time, made of the parts that blocks request in their
 * probe tables (probe.h), in this order and without a pause, so that creep is continuous.
 *
 *     sweep          from the middle to both ends of the range and back, 1 s                always
 *     slow triangle  nine half periods about the middle, each smaller than the last, 2 s    always
 *     silence        the middle and a twentieth of the range, 1 s each
 *     staircase      20 55 90 55 20 0 50 % of the range, 1.5 s each
 *     fast triangle  as the slow one, 0.5 s
 *     chirps         triangles about the middle, from 1 Hz to at most 150 Hz,
 *                    5 and then 30 % of the range wide, 1.5 s each
 *     burst          60 % of the range at up to 40 Hz for 1 s, then a pause of 1.5 s
 *     ladder         about the middle: 80 85 90 95 100 % of the range wide, 0.2 s each
 *     loops          three of a tenth of the range about each of 10 30 50 70 90 %, 0.06 s each
 *     return         the slow triangle once more
 *
 * All lines are straight, even where textbooks use sines. The drive between two frames of a recording is then known,
 * and the response of the electronics can be computed. Every corner lies on a frame, and the ends of triangles are flat
 * for one frame. No line is steeper than the limit: steps become ramps of that slope, and fast parts become slower.
 */
#ifndef PROBE_PLAN_H
#define PROBE_PLAN_H

#include "amplifier/waveform.h"
#include "chain/probe.h"

/** Corners of the longest plan, the breakpoint table of the amplifier. */
#define PROBE_PLAN_MAX_CORNERS 768

/** Limits of what is played. */
typedef struct {
    double range_v[2];
    double slew_v_per_s;      /**< steepest line: range_v in PROBE_PLAN_SLOWEST_S or less */
    double sample_rate_hz;    /**< of the amplifier's loop */
    unsigned long decimation; /**< samples from frame to frame of the recording, 1 or more */
    unsigned long lead;       /**< samples that frame 0 is ahead of the start of what is played */
} probe_limits_t;

#define PROBE_PLAN_SLOWEST_S 0.5

typedef struct {
    unsigned parts; /**< PROBE_ bits */
    probe_limits_t limits;
    double start_v; /**< initial drive: the middle of the range, where earlier creep is least */
    size_t corners;
    breakpoint_t corner[PROBE_PLAN_MAX_CORNERS];
    double samples; /**< length in samples of the loop */
} probe_plan_t;

/**
 * The parts for a block's name, or "all" of them. 0, with the known names in *failure, for an unknown one.
 */
unsigned probe_parts(const char *name, failure_t *failure);

void probe_plan_make(probe_plan_t *plan, unsigned parts, const probe_limits_t *limits);

/** "sweep, slow triangle, staircase". */
void probe_plan_describe(const probe_plan_t *plan, char *text, size_t size);

#endif
