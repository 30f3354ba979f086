/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "belief/shape.h"
#include "belief/rest.h"
#include "belief/suspect_fit.h"
#include "chain/catalogue.h"
#include "diagnosis/noise/lines.h"
#include "diagnosis/noise/remainder.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* All that belongs to one question. */
typedef struct {
    fitted_chain_t *fitted;
    double *left, *open;
} held_out_t;

/* Held-out samples that the fitted ones determine; the others' left is 0 from here on. What is masked is neither.
 * Outliers count as on the edge of the noise, as the fitted ones do. */
static void judge_held_out(const held_out_t *room, shape_t *shape) {
    const hysteresis_t *h = &room->fitted->hysteresis;
    const double variance = h->evidence.variance;
    size_t held = 0, determined = 0;
    double normal = 0.0, worst = 0.0, all = 0.0;
    for (size_t i = 0; i < room->fitted->samples->count; i++) {
        double square = 0.0, range[2];
        size_t count = 0;
        const size_t end = room->fitted->samples->begin[i + 1];
        for (size_t k = room->fitted->samples->begin[i]; k < end; k++) {
            if (room->fitted->samples->part[k] != SAMPLE_HELD_OUT) {
                continue;
            }
            held++;
            if (room->open[k] > threshold.most_open) {
                room->left[k] = 0.0;
                continue;
            }
            count++;
            const double expected = sqrt(variance * (1.0 + room->open[k])), most = threshold.edge_of_noise * expected;
            if (fabs(room->left[k]) > most) {
                room->left[k] = copysign(most, room->left[k]);
                shape->outliers++;
            }
            normal += gsl_pow_2(room->left[k] / expected);
            square += gsl_pow_2(room->fitted->position_um[k] - room->fitted->imitation.simulated_um[k]);
        }
        values_range(room->fitted->position_um + room->fitted->samples->begin[i], end - room->fitted->samples->begin[i],
                     range);
        determined += count;
        all += square;
        worst = fmax(worst, count > 0 ? 100.0 * sqrt(square / (double)count) / (range[1] - range[0]) : 0.0);
    }
    shape->operator_percent = worst;
    shape->left_um = determined > 0 ? sqrt(all / (double)determined) : HUGE_VAL;
    shape->not_determined = held > 0 ? 1.0 - (double)determined / (double)held : 1.0;
    shape->deviations = determined > 0 ? sqrt(normal / (double)determined) : HUGE_VAL;
}

/* What counts as noise besides: steps of the converter, and what the operator leaves of a hysteresis that it was not
 * made for. */
static double floor_of(const samples_t *samples, double step_um) {
    const double one_percent_um = 1.0 / samples_percent(samples, 1.0);
    return hypot(step_um / sqrt(12.0), threshold.operator_accuracy * one_percent_um);
}

bool shape_within_noise(const shape_t *shape, const samples_t *samples, double step_um, double noise_um) {
    return shape->left_um < threshold.most_over_noise * hypot(noise_um, floor_of(samples, step_um));
}

/* Whether only noise is left: by the tests of any remainder, on what is white already. */
static bool is_noise(const held_out_t *room, double step_um, const shape_t *shape) {
    const samples_t *samples = room->fitted->samples;
    const double sigma_um = sqrt(room->fitted->hysteresis.evidence.variance), floor_um = floor_of(samples, step_um);
    const noise_t white = {.sigma_um = sigma_um, .rms_um = sigma_um};
    double *simulated = samples_column(samples), *nothing = samples_column(samples);
    for (size_t k = 0; k < samples->all; k++) {
        simulated[k] = room->fitted->position_um[k] - room->left[k];
    }
    const remainder_t remainder = remainder_of(samples, &white, simulated, nothing, floor_um);
    free(simulated);
    free(nothing);
    return !remainder.structured && shape->deviations < hypot(threshold.most_deviations, floor_um / sigma_um) &&
           shape->not_determined < threshold.most_not_determined &&
           (double)shape->outliers < threshold.most_outliers * (double)samples->all &&
           !rest_is_quieter(room->fitted, step_um, floor_um);
}

/* least: natural units that speak; of a curve, which is shape: as many as in a scan. */
static void note_loudest(const suspects_t *suspects, double least, shape_t *shape) {
    if (suspects->count > 0) {
        shape->loudest = suspects->suspect[0].block;
        shape->gain = fmax(0.0, suspects->suspect[0].gain); /* without amplitude it is worth nothing */
    }
    shape->silent = shape->bends = true;
    for (size_t i = 0; i < suspects->count; i++) {
        const suspect_t *suspect = &suspects->suspect[i];
        const bool bend = suspect->block->probe->shape;
        shape->silent = shape->silent && suspect->gain < (bend ? threshold.least_gain : least);
        shape->bends = shape->bends && (bend || suspect->gain < threshold.least_gain);
    }
}

/* With its numbers searched a block is worth what it is worth; a probe, whose amplitude is free, may be worth as much
 * in noise. */
void shape_scan(fitted_chain_t *fitted, const probe_setting_t *setting, shape_t *shape) {
    double line_hz[LINES_MOST];
    probe_setting_t here = *setting;
    const samples_t *samples = fitted->samples;
    const size_t longest = samples_longest(samples), begin = samples->begin[longest];
    double *left = allocate(samples->recordings[longest].samples, sizeof(double));
    for (size_t k = 0; k < samples->recordings[longest].samples; k++) {
        left[k] = fitted->position_um[begin + k] - fitted->imitation.simulated_um[begin + k];
    }
    here.lines = find_lines(left, samples->recordings[longest].samples, setting->sample_rate_hz, line_hz);
    here.line_hz = line_hz;
    note_loudest(fitted_chain_suspects(fitted, &here), threshold.least_gain, shape);
    if (shape->silent && shape->gain >= threshold.evidence_margin) {
        note_loudest(fitted_suspects(fitted, &here), threshold.least_searched_gain, shape);
    }
    free(left);
}

void shape_of(fitted_chain_t *fitted, double step_um, shape_t *shape) {
    const hysteresis_t *h = &fitted->hysteresis;
    const samples_t *samples = fitted->samples;
    const held_out_t held_out = {.fitted = fitted, .left = samples_column(samples), .open = samples_column(samples)};
    *shape = (shape_t){.fitted = true,
                       .noise_percent = samples_percent(samples, sqrt(h->evidence.variance)),
                       .rho_hz = h->noise.rho * samples_fastest_hz(samples),
                       .turns = h->turns,
                       .law = h->operator.has_law,
                       .outliers = h->outliers,
                       .log_evidence = h->evidence.log_evidence};
    hysteresis_left(h, fitted->imitation.paths, fitted->imitation.count, h->position_um, fitted->use, held_out.left,
                    held_out.open);
    judge_held_out(&held_out, shape);
    shape->whole = is_noise(&held_out, step_um, shape);
    free(held_out.left);
    free(held_out.open);
}
