/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Which shape of hysteresis a diagnosis begins with, when no model was given, and what noise the recordings have. */
#ifndef BASELINE_H
#define BASELINE_H

#include "diagnosis/noise/noise.h"
#include "identify/family.h"

enum { BASELINE_SHAPES = 4 };

typedef struct {
    const family_t *family;
    model_t model;
    bool many_numbers; /**< so many that they imitate effects that are none of a hysteresis */
    double held;       /**< what it leaves of the held-out samples beside the signatures of all blocks */
} baseline_t;

/** Whether what a shape leaves of the held-out samples beside the best probes says something about it: not where that
 * is more than 1.15 times the noise's square. Then blocks are missing that are far from linear and do more than their
 * probes, and each shape imitates another part of that. */
bool baseline_says(const samples_t *samples, const noise_t *noise, double held);

/** The play bank that everything begins with; and as it was fitted, before it was made smooth. */
bool baseline_bank(const recording_t *recordings, size_t count, baseline_t *bank, baseline_t *rough,
                   failure_t *failure);
void baseline_free(baseline_t *baseline, size_t count);

/** Narrow peaks of the residual (lines.h) in the longest recording. */
size_t baseline_lines(const samples_t *samples, const double *residual, double *line_hz);

/** At rest if there is enough of it, else from what a rich model leaves: the nuisance subspace with shapes, trends,
 * lines, and the best probe of every block. */
bool baseline_noise(const samples_t *samples, const model_t *model, const probe_setting_t *setting, noise_t *noise,
                    failure_t *failure);

/**
 * baseline[0] is the bank. Adds the other shapes of hysteresis (Bouc-Wen, Preisach), and sorts: the one whose
 * derivatives, together with the best probe of every block, leave least of the held-out samples first; where that says
 * nothing, the bank, unless it is 5 % behind. Those that leave ten times as much are left out. baseline[0] and *rough
 * change places where the smooth bank is the worse one.
 */
bool baseline_shapes(const samples_t *samples, const noise_t *noise, const probe_setting_t *setting,
                     baseline_t baseline[BASELINE_SHAPES], baseline_t *rough, size_t *count, failure_t *failure);

#endif
