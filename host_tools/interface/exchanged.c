/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "interface/exchanged.h"
#include "diagnosis/question/excerpt.h"
#include "identify/fit.h"
#include "look/swapped.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdio.h>

/* What play operators leave, in percent of the stroke: of the samples that they are fitted to, and of those held out.
 */
typedef struct {
    double fitted, held_out;
} left_t;

static bool less(const left_t *left, const left_t *other) {
    return left->fitted < other->fitted && left->held_out < other->held_out;
}

static bool plays_leave(const recording_t *recording, left_t *left) {
    const family_t *plays = family_find("prandtl_ishlinskii");
    const fit_options_t options = {0};
    model_t model;
    fit_report_t report;
    failure_t ignored;
    if (!fit_recordings(plays, recording, 1, &options, &model, &report, &ignored)) {
        return false;
    }
    *left = (left_t){report.nrmse_percent, report.held_out_nrmse_percent};
    fit_report_free(&report);
    model_free(&model);
    return true;
}

static double drive_at(const recording_t *recording, double sample) {
    const size_t before = (size_t)sample;
    const double part = sample - (double)before, *drive_v = recording->column[COLUMN_DRIVE];
    return part > 0.0 ? drive_v[before] + part * (drive_v[before + 1] - drive_v[before]) : drive_v[before];
}

/* What a straight line leaves of the position, over the drive so many samples later: squared, in parts of it. */
static double line_leaves(const recording_t *recording, double lead, size_t count) {
    const double *const y = recording->column[COLUMN_DISPLACEMENT];
    double mean_u = 0.0, mean_y = 0.0, uu = 0.0, uy = 0.0, yy = 0.0;
    for (size_t k = 0; k < count; k++) {
        const double u = drive_at(recording, (double)k + lead), n = (double)k + 1.0, du = u - mean_u,
                     dy = y[k] - mean_y;
        mean_u += du / n;
        mean_y += dy / n;
        uu += du * (u - mean_u);
        uy += du * (y[k] - mean_y);
        yy += dy * (y[k] - mean_y);
    }
    return uu > 0.0 && yy > 0.0 ? 1.0 - uy * uy / (uu * yy) : 1.0;
}

/* A position that is early, or leaks: the same recording with the drive moved to where a straight line leaves least. */
static void move_drive(const recording_t *recording, recording_t *moved) {
    const size_t most = recording->samples / 20, count = recording->samples - most - 1;
    double best = 0.0, lead = 0.1, least = line_leaves(recording, 0.0, count);
    while (lead < (double)most) {
        const double leaves = line_leaves(recording, lead, count);
        best = leaves < least ? lead : best;
        least = fmin(leaves, least);
        lead *= 1.1;
    }
    recording_copy(moved, recording, 0, count);
    for (size_t k = 0; k < count; k++) {
        moved->column[COLUMN_DRIVE][k] = drive_at(recording, (double)k + best);
    }
}

/* Whether play operators leave less the other way round than as it is, and than with a position that leads. */
static bool is_exchanged(const recording_t *recording, left_t *as_it_is, left_t *exchanged) {
    const recording_t turned = swapped_turned(recording);
    recording_t moved;
    left_t led;
    if (!swapped_suspected(recording) || !plays_leave(recording, as_it_is) || !plays_leave(&turned, exchanged) ||
        !less(exchanged, as_it_is)) {
        return false;
    }
    move_drive(recording, &moved);
    const bool good = plays_leave(&moved, &led) && less(exchanged, &led);
    recording_free(&moved);
    return good;
}

/* Of a long recording, of as much as a diagnosis would use. */
static bool part_is_exchanged(const recording_t *recording, left_t *as_it_is, left_t *exchanged) {
    const size_t most = (size_t)threshold.most_samples;
    if (recording->samples <= most) {
        return is_exchanged(recording, as_it_is, exchanged);
    }
    recording_t part;
    excerpt_copy(recording, most, &part);
    const bool found = is_exchanged(&part, as_it_is, exchanged);
    recording_free(&part);
    return found;
}

static void tell_command(const recording_t *recording, char *text, size_t room) {
    const bool own = recording->understood == NULL;
    (void)snprintf(text, room,
                   "`hyst import %s --drive %s --displacement %s -o NEW` exchanges them, and "
                   "--columns-are-right goes on with them as they are",
                   recording->name, own ? "displacement" : "..", own ? "drive" : "..");
}

bool exchanged_refuse(const recording_t *recordings, size_t count, const char *hint, failure_t *failure) {
    for (size_t i = 0; i < count; i++) {
        const recording_t *recording = &recordings[i];
        left_t as_it_is, exchanged;
        char commands[600];
        if (!part_is_exchanged(recording, &as_it_is, &exchanged)) {
            continue;
        }
        tell_command(recording, commands, sizeof commands);
        return fail(failure,
                    "%s: drive and displacement are exchanged: the displacement is exact and leads, and play operators "
                    "leave %.2g %% of the stroke where it is the drive, %.2g %% as it is; %s",
                    recording->name, exchanged.held_out, as_it_is.held_out, hint != NULL ? hint : commands);
    }
    return true;
}
