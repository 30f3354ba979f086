/* SPDX-License-Identifier: MIT */
/**
 * The reference generator: what the amplifier plays on its own, sample by sample.
 *
 *   hold         moves to the setpoint, at most `slew` per sample, and stays there.
 *   sine         offset + amplitude * sin(2 pi phase), the phase advancing by increment / 2^32 turns per sample from 0.
 *   breakpoints  straight lines from value to value.
 *   sweep        as the sine, its increment going from one value to another (sweep.h).
 *   multisine    offset + amplitude * the sum of the tones, of which each is
 *                amplitude * sin(2 pi (harmonic * phase + its own phase)).
 *
 * Exactness. A breakpoint's line is the exact one rounded to the nearest unit of 2^-31 in every sample, and ends
 * exactly on its value, whatever its length. The sine is within 5 units of 2^-31 (2.4e-9) of the true one before it is
 * scaled, and so is each tone of a multisine, up to one more unit; sums saturate. Proof: tests/firmware/test_source.c.
 *
 * The end. A source that is through (cycles) ends on the last breakpoint, or where its last whole turn ends: a sine and
 * a sweep on the offset, a multisine on its value at phase 0. Then it holds.
 *
 * May be called from: the context that owns the source_t (the sample interrupt; the main loop under board_lock).
 * Constant time but for the divisions at the start of a line.
 */
#ifndef SOURCE_H
#define SOURCE_H

#include "hyst/fixed.h"
#include "motion/sweep.h"
#include <stdbool.h>

/** Register `source`. */
typedef enum {
    SOURCE_HOLD = 0,
    SOURCE_SINE = 1,
    SOURCE_BREAKPOINTS = 2,
    SOURCE_SWEEP = 3,
    SOURCE_MULTISINE = 4
} source_kind_t;

/** Line to `value`, reached after `samples` samples. 0 counts as 1: a step. */
typedef struct {
    uint32_t samples;
    hyst_q31_t value;
} source_point_t;

/** A tone of a multisine. */
typedef struct {
    uint32_t harmonic;    /**< 1 or more; harmonic * increment is at most 2^31 */
    hyst_q31_t amplitude; /**< of what the multisine's own amplitude is the scale of */
    uint32_t phase;       /**< at its beginning, in 2^-32 turns */
} source_tone_t;

/** In the h405's image, counted under emulation, sixteen tones take 670 instructions more than a sine, and a
 * logarithmic sweep takes 45 more. */
#define SOURCE_TONES_MAX 16U

typedef struct {
    source_kind_t kind;
    hyst_q31_t offset, amplitude; /**< sine, sweep, multisine */
    uint32_t increment;           /**< sine, multisine: 1 to 2^31 (half a turn: the Nyquist frequency) */
    uint32_t cycles;              /**< turns or passes, 0 without end */
    const source_point_t *points; /**< breakpoints; must not change while they play */
    uint32_t point_count;         /**< breakpoints, 1 or more */
    const source_tone_t *tones;   /**< multisine; must not change while it plays */
    uint32_t tone_count;          /**< multisine, 1 to SOURCE_TONES_MAX */
    sweep_t sweep;                /**< sweep: as sweep_make made it; samples 0 is none */
} source_settings_t;

/** The line that is being played: from + delta * sample / samples in integer arithmetic, without a division a sample.
 * In 32 bits, modulo 2^32: the sums fit, although a delta may not. */
typedef struct {
    uint32_t left;      /**< samples until the end */
    uint32_t samples;   /**< length, 1 or more */
    uint32_t quotient;  /**< of delta / samples, rounded down, modulo 2^32 */
    uint32_t remainder; /**< of the same: 0 .. samples */
    uint32_t lacking;   /**< in 1 / samples, until the present value is one more: 1 .. samples */
} source_line_t;

typedef struct {
    source_settings_t settings;
    bool playing;
    hyst_q31_t value;    /**< reference of the last sample */
    hyst_q31_t setpoint; /**< follows the value while playing */
    hyst_q31_t slew;     /**< > 0 */
    uint32_t phase;      /**< of the last sample of a sine or multisine */
    uint32_t cycles;     /**< complete turns or passes; a sine or multisine begins with -1, ending the turn before */
    uint32_t point;      /**< that the present line goes to */
    source_line_t line;
    sweep_state_t sweep;
} source_t;

/** Can it be played? */
bool source_settings_valid(const source_settings_t *settings);

/** Holds `value`. */
void source_reset(source_t *source, hyst_q31_t value, hyst_q31_t slew);

/** From the next step on. Kind SOURCE_HOLD stops. */
void source_start(source_t *source, const source_settings_t *settings);

/** Holds the last value. */
void source_stop(source_t *source);

/** Reference of the next sample. */
hyst_q31_t source_step(source_t *source);

/** value, moved towards target by at most step (> 0). */
hyst_q31_t source_approach(hyst_q31_t value, hyst_q31_t target, hyst_q31_t step);

#endif
