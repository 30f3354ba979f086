/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/align.h"
#include "base/quantity.h"
#include "chain/smooth_drive.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Parts of a sample below which a time is a whole number of samples: rounding of a key that was written in decimals. */
static const double whole_within = 1e-6;
/* The same of two times that were both written in decimals, in parts of them. */
static const double whole_steps_within = 1e-3;

enum { MOST_STEPS = 65535 };

/* The value at `fraction` of the way from sample `newer` back to the one before. Before the first one it rested. */
static double value_at(const double *u, size_t samples, size_t newer, double fraction, const double weight[4]) {
    const size_t ahead = samples - 1 - newer;
    double x[6];
    for (size_t i = 0; i < 6; i++) {
        const size_t later = newer + 2; /* index of x[0] */
        x[i] = later >= i + samples ? 0.0 : u[later < i ? 0 : later - i];
    }
    return smooth_drive_value(x, ahead < 2 ? ahead : 2, fraction, weight);
}

static void take_later(double *u, size_t samples, size_t first, size_t kept, ptrdiff_t newer, double fraction) {
    double *taken = allocate(kept, sizeof *taken), weight[4];
    smooth_drive_weights(fraction, weight);
    for (size_t k = 0; k < kept; k++) {
        const size_t at = (size_t)((ptrdiff_t)(first + k) + newer);
        taken[k] = fraction > 0.0 ? value_at(u, samples, at, fraction, weight) : u[at];
    }
    memcpy(u + first, taken, kept * sizeof *u);
    free(taken);
}

static void tell(recording_t *recording, double after_s, size_t dropped) {
    char line[300], lag[QUANTITY_TEXT];
    const char *before = recording->understood != NULL ? recording->understood : "";
    quantity_named(lag, "", "s", fabs(after_s), 4);
    (void)snprintf(line, sizeof line,
                   "drive        taken %s %s, when the position was sampled (header key "
                   "displacement_sampled_after_s); %zu row%s dropped\n",
                   lag, after_s > 0.0 ? "later" : "earlier", dropped, dropped == 1 ? "" : "s");
    char *text = allocate(strlen(before) + strlen(line) + 1, 1);
    memcpy(text, before, strlen(before));
    memcpy(text + strlen(before), line, strlen(line) + 1);
    free(recording->understood);
    recording->understood = text;
}

/* A drive that is held has no values between its own: whole samples are moved, and the rest is how long the last one
 * has been out. */
static bool align_held(recording_t *recording, double after_s) {
    const double shift = after_s * recording->sample_rate_hz;
    const double whole = shift == 0.0 ? 0.0 : ceil(shift - whole_within) - 1.0;
    const ptrdiff_t newer = (ptrdiff_t)whole;
    const size_t first = newer < 0 ? (size_t)-newer : 0, behind = newer > 0 ? (size_t)newer : 0;
    const size_t kept = recording->samples - first - behind;
    char text[40];
    recording->held = true;
    recording->held_since = fmin(1.0, shift - whole);
    if (newer == 0) {
        return true;
    }
    for (column_t c = 0; c < COLUMN_COUNT; c++) {
        if (recording->column[c] != NULL && (c == COLUMN_DRIVE || c == COLUMN_REFERENCE)) {
            take_later(recording->column[c], recording->samples, first, kept, newer, 0.0);
        }
    }
    recording_keep(recording, first, kept);
    (void)snprintf(text, sizeof text, "%.17g", recording->held_since / recording->sample_rate_hz);
    recording_set_key(recording, "displacement_sampled_after_s", text);
    (void)snprintf(text, sizeof text, "%.17g", whole / recording->sample_rate_hz);
    recording_set_key(recording, "drive_moved_s", text);
    tell(recording, whole / recording->sample_rate_hz, first + behind);
    return true;
}

/* Header key drive_step_s. */
static bool take_steps(recording_t *recording, failure_t *failure) {
    const char *text = recording_key(recording, "drive_step_s");
    char *end = NULL;
    const double step_s = text != NULL ? strtod(text, &end) : 0.0;
    const double steps = text != NULL ? 1.0 / (recording->sample_rate_hz * step_s) : 0.0;
    if (text != NULL && (end == text || *end != '\0' || !(step_s > 0.0) || !(steps > 1.0 - whole_steps_within) ||
                         fabs(steps - round(steps)) > whole_steps_within * steps || steps > MOST_STEPS)) {
        return fail(
            failure,
            "%s: header key drive_step_s is '%s', not a time in s of which 1 to %d make the %g s from row to row",
            recording->name, text, MOST_STEPS, 1.0 / recording->sample_rate_hz);
    }
    recording->steps = (size_t)round(steps);
    return true;
}

bool recording_align(recording_t *recording, failure_t *failure) {
    double after_s;
    char text[40];
    drive_between_t between;
    if (!recording_drive_between(recording, &between, failure) ||
        !recording_sampled_after(recording, &after_s, failure) || !take_steps(recording, failure)) {
        return false;
    }
    const bool held = between == BETWEEN_HELD;
    if (after_s == 0.0) {
        recording->held = held;
        return true;
    }
    const double shift = after_s * recording->sample_rate_hz;
    if (!(fabs(shift) + 1.0 <= 0.5 * (double)recording->samples)) {
        return fail(failure,
                    "%s: header key displacement_sampled_after_s is %g s: that leaves less than half of %zu "
                    "samples at %g Hz",
                    recording->name, after_s, recording->samples, recording->sample_rate_hz);
    }
    if (held) {
        return align_held(recording, after_s);
    }
    const double whole = fabs(shift - round(shift)) < whole_within ? round(shift) : ceil(shift);
    const ptrdiff_t newer = (ptrdiff_t)whole;
    const double fraction = fmax(0.0, whole - shift) < whole_within ? 0.0 : whole - shift;
    const ptrdiff_t older = fraction > 0.0 ? newer - 1 : newer;
    const size_t first = older < 0 ? (size_t)-older : 0, behind = newer > 0 ? (size_t)newer : 0;
    const size_t samples = recording->samples, kept = samples - first - behind;
    for (column_t c = 0; c < COLUMN_COUNT; c++) {
        double *value = recording->column[c];
        if (value != NULL && (c == COLUMN_DRIVE || c == COLUMN_REFERENCE)) {
            take_later(value, samples, first, kept, newer, fraction);
        }
    }
    recording_keep(recording, first, kept);
    recording_set_key(recording, "displacement_sampled_after_s", "0");
    (void)snprintf(text, sizeof text, "%.17g", after_s);
    recording_set_key(recording, "drive_moved_s", text);
    tell(recording, after_s, first + behind);
    return true;
}
