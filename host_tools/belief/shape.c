/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/shape.h"
#include "chain/catalogue.h"
#include "diagnosis/noise/lines.h"
#include "diagnosis/noise/remainder.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

/* Samples of a rest that counts; and at rest, or in motion, for a comparison: their mean square is then known to a
 * tenth. */
enum { LEAST_REST = 20, LEAST_RESTING = 200 };

/* All that belongs to one question. */
typedef struct {
    fitted_chain_t *fitted;
    double *left, *open;
} held_out_t;

/* Held-out samples that the fitted ones determine; the others' left is 0 from here on. */
static void judge_held_out(const held_out_t *room, shape_t *shape) {
    const hysteresis_t *h = &room->fitted->hysteresis;
    const double variance = h->evidence.variance;
    size_t held = 0, determined = 0;
    double normal = 0.0, worst = 0.0;
    for (size_t i = 0; i < room->fitted->samples->count; i++) {
        double square = 0.0, range[2];
        size_t count = 0;
        const size_t end = room->fitted->samples->begin[i + 1];
        for (size_t k = room->fitted->samples->begin[i]; k < end; k++) {
            if (room->fitted->use[k] != 0) {
                continue;
            }
            held++;
            if (room->open[k] > threshold.most_open) {
                room->left[k] = 0.0;
                continue;
            }
            count++;
            normal += room->left[k] * room->left[k] / (variance * (1.0 + room->open[k]));
            square += gsl_pow_2(room->fitted->position_um[k] - room->fitted->imitation.simulated_um[k]);
        }
        values_range(room->fitted->position_um + room->fitted->samples->begin[i], end - room->fitted->samples->begin[i],
                     range);
        determined += count;
        worst = fmax(worst, count > 0 ? 100.0 * sqrt(square / (double)count) / (range[1] - range[0]) : 0.0);
    }
    shape->operator_percent = worst;
    shape->not_determined = held > 0 ? 1.0 - (double)determined / (double)held : 1.0;
    shape->deviations = determined > 0 ? sqrt(normal / (double)determined) : HUGE_VAL;
}

/* Mean square of what is left where the drive rests, and where it moves. */
static bool rests_as_it_moves(const held_out_t *room, double step_um) {
    double rest = 0.0, move = 0.0;
    size_t resting = 0, moving = 0;
    for (size_t i = 0; i < room->fitted->samples->count; i++) {
        const recording_t *r = &room->fitted->samples->recordings[i];
        const double *drive = r->column[COLUMN_DRIVE], *left = room->left + room->fitted->samples->begin[i];
        const size_t settled = (size_t)fmax(LEAST_REST, threshold.least_rest_s * r->sample_rate_hz);
        double range[2];
        values_range(drive, r->samples, range);
        for (size_t k = 0, since = 0; k < r->samples; k++) {
            since = fabs(drive[k] - drive[since]) <= threshold.still * (range[1] - range[0]) ? since : k;
            if (k - since > settled) {
                rest += left[k] * left[k];
                resting++;
            } else {
                move += left[k] * left[k];
                moving++;
            }
        }
    }
    const double step_error = step_um * step_um / 12.0;
    if (resting < LEAST_RESTING || moving < LEAST_RESTING) {
        return true;
    }
    const double chance = threshold.beyond_chance_altogether * sqrt(2.0 / (double)resting);
    return move / (double)moving <=
           threshold.most_moving_over_resting * (1.0 + chance) * (rest / (double)resting + step_error);
}

/* Whether only noise is left: by the tests of any remainder, on what is white already. */
static bool is_noise(const held_out_t *room, double step_um, const shape_t *shape) {
    const samples_t *samples = room->fitted->samples;
    const double sigma_um = sqrt(room->fitted->hysteresis.evidence.variance);
    const noise_t white = {.sigma_um = sigma_um, .rms_um = sigma_um};
    double *simulated = samples_column(samples), *nothing = samples_column(samples);
    for (size_t k = 0; k < samples->all; k++) {
        simulated[k] = room->fitted->position_um[k] - room->left[k];
    }
    const remainder_t remainder = remainder_of(samples, &white, simulated, nothing, step_um / sqrt(12.0));
    free(simulated);
    free(nothing);
    return !remainder.structured && shape->deviations < threshold.most_deviations &&
           shape->not_determined < threshold.most_not_determined &&
           (double)shape->outliers < threshold.most_outliers * (double)samples->all && rests_as_it_moves(room, step_um);
}

/* least: natural units that speak. */
static void note_loudest(const suspect_t *suspect, size_t count, double least, shape_t *shape) {
    if (count > 0) {
        shape->loudest = suspect[0].block;
        shape->gain = suspect[0].gain;
    }
    shape->silent = shape->gain < least;
}

/* With its numbers searched a block is worth what it is worth; a probe, whose amplitude is free, may be worth as much
 * in noise. */
static void scan_catalogue(const held_out_t *room, const probe_setting_t *setting, shape_t *shape) {
    double line_hz[LINES_MOST];
    probe_setting_t here = *setting;
    const samples_t *samples = room->fitted->samples;
    const size_t longest = samples_longest(samples), begin = samples->begin[longest];
    double *left = allocate(samples->recordings[longest].samples, sizeof(double));
    for (size_t k = 0; k < samples->recordings[longest].samples; k++) {
        left[k] = room->fitted->position_um[begin + k] - room->fitted->imitation.simulated_um[begin + k];
    }
    here.lines = find_lines(left, samples->recordings[longest].samples, setting->sample_rate_hz, line_hz);
    here.line_hz = line_hz;
    const scan_t scan = fitted_chain_scan(room->fitted, &here);
    suspect_t *suspect;
    size_t count;
    scan_blocks(&scan, &suspect, &count, NULL);
    note_loudest(suspect, count, threshold.least_gain, shape);
    if (shape->silent && shape->gain >= threshold.evidence_margin) {
        note_loudest(suspect, scan_refine(&scan, suspect, count), threshold.least_searched_gain, shape);
    }
    suspects_free(suspect, count);
    free(left);
}

void shape_of(fitted_chain_t *fitted, const probe_setting_t *setting, double step_um, bool scan, shape_t *shape) {
    const hysteresis_t *h = &fitted->hysteresis;
    const samples_t *samples = fitted->samples;
    const held_out_t held_out = {.fitted = fitted, .left = samples_column(samples), .open = samples_column(samples)};
    *shape = (shape_t){.fitted = true,
                       .noise_percent = samples_percent(samples, sqrt(h->evidence.variance)),
                       .rho_hz = h->noise.rho * samples->recordings[0].sample_rate_hz,
                       .turns = h->turns,
                       .law = h->operator.has_law,
                       .outliers = h->outliers,
                       .log_evidence = h->evidence.log_evidence};
    hysteresis_left(h, fitted->imitation.paths, fitted->imitation.count, h->position_um, fitted->use, held_out.left,
                    held_out.open);
    judge_held_out(&held_out, shape);
    shape->whole = is_noise(&held_out, step_um, shape);
    if (scan) {
        scan_catalogue(&held_out, setting, shape);
    }
    free(held_out.left);
    free(held_out.open);
}

void shape_ask(const samples_t *samples, const model_t *chain, const probe_setting_t *setting, double step_um,
               bool scan, shape_t *shape) {
    fitted_chain_t fitted;
    model_t operated;
    *shape = (shape_t){0};
    chain_for_operator(chain, &operated);
    if (fitted_chain_open(&fitted, samples, &operated)) {
        shape_of(&fitted, setting, step_um, scan, shape);
        fitted_chain_close(&fitted);
    }
    model_free(&operated);
}
