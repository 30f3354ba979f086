/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Samples taken at uneven times: noise that grows with the speed of the position. The errors of the prediction from
 * neighbours are compared between the fastest and the slowest third of the samples, by robust deviations (relative
 * error 1 / sqrt(0.74 n) each). For physics that predicts badly where it is fast: the errors have to resemble each
 * other from sample to sample as white noise behind that prediction does. Behind a converter that is slower than the
 * recording the position has stairs: neighbours do not predict them, and their height goes with the speed. So nothing
 * is said of jitter there. */
#include "look/fault.h"
#include "thresholds/thresholds.h"
#include <math.h>
#include <stdlib.h>

static const double rounding = 0.29, robust_efficiency = 0.74;

/* Square sum of the prediction's weights, and what it makes of white noise from one sample to the next. */
static double white_square(const prediction_t *p, double *next) {
    double weight[2 * PREDICTION_REACH + 1], square = 0.0;
    for (size_t j = 0; j < PREDICTION_REACH; j++) {
        weight[PREDICTION_REACH + 1 + j] = weight[PREDICTION_REACH - 1 - j] = -p->echo[j];
    }
    weight[PREDICTION_REACH] = 1.0;
    *next = 0.0;
    for (size_t i = 0; i < 2 * PREDICTION_REACH + 1; i++) {
        square += weight[i] * weight[i];
        *next += i > 0 ? weight[i] * weight[i - 1] : 0.0;
    }
    *next /= square;
    return square;
}

typedef struct {
    double deviation, speed, next; /* of the errors; root mean square speed; correlation with the next */
    double by_speed;               /* deviation of the errors over the speed, samples */
    size_t count;
} third_t;

/* A reading at an end of the range may be a converter's end: there is no noise. */
static bool at_end(const look_t *look, size_t k) {
    const double y = look->recording->column[COLUMN_DISPLACEMENT][k];
    return y == look->map.stroke_um[0] || y == look->map.stroke_um[1];
}

static third_t third_of(const look_t *look, const double *speed, double from, double to) {
    const prediction_t *p = &look->prediction;
    double *picked = allocate(2 * p->samples, sizeof *picked), *ratio = picked + p->samples, product = 0.0,
           square = 0.0, speeds = 0.0;
    third_t third = {0};
    for (size_t k = 0; k + 1 < p->samples; k++) {
        if (p->quiet[k] != 0 && speed[k] >= from && speed[k] < to) {
            ratio[third.count] = speed[k] > 0.0 ? p->error[k] / speed[k] : 0.0;
            picked[third.count++] = p->error[k];
            speeds += speed[k] * speed[k];
        }
    }
    third.deviation = third.count > 0 ? look_robust_deviation(picked, third.count) : 0.0;
    third.by_speed = third.count > 0 ? look_robust_deviation(ratio, third.count) : 0.0;
    for (size_t k = 0; k + 1 < p->samples; k++) {
        const bool both = p->quiet[k] != 0 && p->quiet[k + 1] != 0 && speed[k] >= from && speed[k] < to;
        if (both && fabs(p->error[k]) < threshold.left_out_beyond * third.deviation &&
            fabs(p->error[k + 1]) < threshold.left_out_beyond * third.deviation) {
            product += p->error[k] * p->error[k + 1];
            square += 0.5 * (p->error[k] * p->error[k] + p->error[k + 1] * p->error[k + 1]);
        }
    }
    third.speed = third.count > 0 ? sqrt(speeds / (double)third.count) : 0.0;
    third.next = square > 0.0 ? product / square : 0.0;
    free(picked);
    return third;
}

static void find_in(const look_t *look, size_t index, const fault_kind_t *kind, fault_list_t *faults) {
    const size_t samples = look->recording->samples;
    const look_span_t span = look->reference.span;
    double *speed = allocate(samples, sizeof *speed), next;
    if (look->drive.kind == DRIVE_RESTS || (double)span_length(span) < 3.0 * threshold.least_in_third) {
        free(speed);
        return;
    }
    for (size_t k = 0; k < samples; k++) { /* outside the reference, and where nothing is read: in no third */
        const bool inside = k >= span.from && k < span.to && !at_end(look, k) && !(k > 2 && at_end(look, k - 3)) &&
                            !(k + 3 < samples && at_end(look, k + 3));
        speed[k] = inside ? fabs(look->reference.slope[k]) : -1.0;
    }
    const double slow = look_quantile(speed + span.from, span_length(span), 1.0 / 3.0);
    const double fast = look_quantile(speed + span.from, span_length(span), 2.0 / 3.0);
    const third_t low = third_of(look, speed, 0.0, slow), high = third_of(look, speed, fast, HUGE_VAL);
    const double square = white_square(&look->prediction, &next),
                 step = fmax(look->noise.step_um, look->noise.digit_um);
    free(speed);
    const double floor_um = threshold.jitter_of_step * rounding * step * sqrt(square);
    if ((double)low.count < threshold.least_in_third || (double)high.count < threshold.least_in_third ||
        !(high.deviation > threshold.faster_is_worse * fmax(low.deviation, 1e-12)) || !(high.deviation > floor_um) ||
        fabs(high.next - next) > threshold.like_white + threshold.edge_of_noise / sqrt((double)high.count)) {
        return;
    }
    const double relative =
        sqrt(1.0 / (robust_efficiency * (double)high.count) + 1.0 / (robust_efficiency * (double)low.count));
    const double z = log(high.deviation / fmax(low.deviation, 0.1 * high.deviation)) / relative;
    const double still = low.deviation / high.speed; /* what is no jitter, or little of it */
    const double jitter = sqrt(fmax(0.0, high.by_speed * high.by_speed - still * still) / square);
    if (!(jitter > threshold.least_jitter)) {
        return;
    }
    fault_t *fault = fault_add(faults, kind, index, z, look_log_chance_normal(z, 1.0));
    if (fault != NULL) {
        const double rate_hz = look->recording->sample_rate_hz;
        /* The prediction's weights are means over all speeds: they are wrong for the fastest. */
        const double sigma =
            jitter * hypot(threshold.weights_wrong, 1.0 / sqrt(robust_efficiency * (double)high.count));
        fault_number(fault, "rms_s", "s", jitter / rate_hz, sigma / rate_hz);
        fault_number(fault, "rms_samples", "1", jitter, sigma);
    }
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        /* A gap is crossed at speed; and so are stairs. */
        if (fault_found(faults, &fault_missing_codes, i) || looks[i].drive.held_samples > 1) {
            continue;
        }
        find_in(&looks[i], i, kind, faults);
    }
}

const fault_kind_t fault_time_jitter = {
    .name = "time_jitter",
    .order = 130,
    .text = "The noise grows with the speed of the position: samples were taken at uneven times.",
    .statistic = "logarithm of the noise of the fastest over that of the slowest third of the samples, over its error",
    .change =
        "Let a hardware timer trigger the converters, not a program's loop; or record when each sample was taken.",
    .handling = FAULT_MODELLABLE,
    .find = find};
