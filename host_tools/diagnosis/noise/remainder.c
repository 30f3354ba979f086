/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/noise/remainder.h"
#include "numerics/spectrum.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <gsl/gsl_statistics_double.h>
#include <stdlib.h>

enum { BANDS = 64, LEVEL_BANDS = 64 };

typedef struct {
    double energy, expected, ordinates, raw; /* raw: what is too much, before whitening */
} band_t;

/* The level that most of the spectrum keeps to, in parts of the noise at rest: less than 1 where that had something
 * else in it. */
static double level_of(const spectrum_t *s, double expected) {
    double level[LEVEL_BANDS];
    for (size_t band = 0; band < LEVEL_BANDS; band++) {
        const size_t from = 1 + band * (s->count - 2) / LEVEL_BANDS, to = 1 + (band + 1) * (s->count - 2) / LEVEL_BANDS;
        double sum = 0.0;
        for (size_t f = from; f < to; f++) {
            sum += s->energy[f];
        }
        level[band] = to > from ? sum / (expected * (double)(to - from)) : 1.0;
    }
    return fmin(1.0, gsl_stats_median(level, 1, LEVEL_BANDS));
}

static size_t band_of(double hz, double lowest_hz) {
    const double band = 2.0 * log2(hz / lowest_hz);
    return band < 0.0 ? 0 : band >= BANDS ? BANDS - 1 : (size_t)band;
}

static void add_recording(const samples_t *samples, const noise_t *noise, size_t i, const double *white,
                          double lowest_hz, band_t *band) {
    const recording_t *recording = &samples->recordings[i];
    const size_t from = samples->from[i] + SAMPLES_SKIPPED, length = recording->samples - from;
    const double variance = gsl_pow_2(noise->sigma_um);
    spectrum_t s;
    spectrum_of(white + samples->begin[i] + from, length, recording->sample_rate_hz, &s);
    const double level = level_of(&s, s.white * variance), finer = 0.5 * s.white; /* of neighbours, one counts */
    for (size_t f = 1; f + 1 < s.count; f++) {
        band_t *b = &band[band_of((double)f * s.step_hz, lowest_hz)];
        const double expected = level * s.white * variance;
        b->energy += s.energy[f];
        b->expected += expected;
        b->ordinates += finer / 1.5; /* Hann's window: 1.5 bins */
        b->raw += (s.energy[f] - expected) *
                  noise_filter_power(&noise->filter, (double)f * s.step_hz / recording->sample_rate_hz);
    }
    spectrum_free(&s);
}

/* Root mean square of a column over the samples of one part. */
static double rms_of(const samples_t *samples, samples_part_t part, const double *column) {
    const size_t count = part == SAMPLE_FITTED ? samples->fitted : samples->held;
    return sqrt(samples_square(samples, part, column) / (double)count);
}

/* What is left, and what was found: as they are, and whitened. */
typedef struct {
    const samples_t *samples;
    const noise_t *noise;
    double *left, *white, *found_white;
    const double *found;
    double floor_um;
} columns_t;

/* memory: of the noise in these columns, between neighbours. Its mean square is known to the fewer, the longer that is.
 */
static bool is_more(const columns_t *c, samples_part_t part, double noise_um, double memory, const double *left,
                    const double *found) {
    const double count = (double)(part == SAMPLE_FITTED ? c->samples->fitted : c->samples->held);
    const double neighbours = (1.0 + memory * memory) / (1.0 - memory * memory);
    const double chance = threshold.beyond_chance_altogether * sqrt(2.0 * neighbours / count);
    const double least_um = threshold.worth_mentioning * noise_um + c->floor_um +
                            threshold.wrong_altogether * rms_of(c->samples, part, found);
    return rms_of(c->samples, part, left) > hypot(noise_um * sqrt(1.0 + chance), least_um);
}

/* Both as it is and whitened: jumps stand out when whitened, a slow noise's own size is not well known. */
static bool more_than_noise(const columns_t *c, samples_part_t part) {
    return is_more(c, part, c->noise->sigma_um, 0.0, c->white, c->found_white) &&
           is_more(c, part, c->noise->rms_um, c->noise->filter.memory, c->left, c->found);
}

bool remainder_knows_noise(const samples_t *samples, const noise_t *noise) {
    return noise->at_rest || noise->between_passes ||
           samples_percent(samples, noise->rms_um) < threshold.most_noise_percent;
}

static void take_columns(columns_t *c, const double *simulated) {
    samples_residual(c->samples, simulated, c->left);
    noise_whiten(c->noise, c->samples, c->left, c->white);
    noise_whiten(c->noise, c->samples, c->found, c->found_white);
}

static void look_at_bands(const columns_t *c, remainder_t *remainder) {
    const double lowest_hz = 1.0 / samples_longest_s(c->samples);
    double most = 0.0, excess = 0.0;
    band_t band[BANDS] = {{0}};
    for (size_t i = 0; i < c->samples->count; i++) {
        add_recording(c->samples, c->noise, i, c->white, lowest_hz, band);
    }
    for (size_t b = 0; b < BANDS; b++) {
        if (band[b].ordinates > 0.0 &&
            band[b].energy / band[b].expected > 1.0 + threshold.beyond_chance / sqrt(band[b].ordinates) +
                                                    gsl_pow_2(threshold.beyond_chance) / (4.0 * band[b].ordinates)) {
            excess += band[b].raw;
            if (band[b].raw > most) {
                most = band[b].raw;
                remainder->low_hz = lowest_hz * exp2(0.5 * (double)b);
                remainder->high_hz = lowest_hz * exp2(0.5 * (double)(b + 1));
            }
        }
    }
    remainder->rms_um = sqrt(fmax(0.0, excess) / (double)(c->samples->fitted + c->samples->held));
}

static bool look_at_levels(const columns_t *c, const double *simulated, remainder_t *remainder) {
    const double sigma_um = c->noise->sigma_um;
    const double off_um = threshold.wrong_at_levels * rms_of(c->samples, SAMPLE_FITTED, c->found_white) + c->floor_um;
    remainder->by_level = by_level(c->samples, sigma_um, simulated, c->white);
    return remainder->by_level.part > threshold.worth_mentioning_at_levels + off_um / sigma_um;
}

static size_t count_outliers(const columns_t *c) {
    size_t outliers = 0;
    for (size_t k = 0; k < c->samples->all; k++) {
        const double expected = threshold.outlier * hypot(c->noise->sigma_um, c->floor_um) +
                                threshold.wrong_at_a_sample * fabs(c->found_white[k]);
        outliers += c->samples->part[k] != SAMPLE_LEFT_OUT && fabs(c->white[k]) > expected ? 1 : 0;
    }
    return outliers;
}

remainder_t remainder_of(const samples_t *samples, const noise_t *noise, const double *simulated, const double *effect,
                         double floor_um) {
    columns_t c = {.samples = samples,
                   .noise = noise,
                   .left = samples_column(samples),
                   .white = samples_column(samples),
                   .found_white = samples_column(samples),
                   .found = effect,
                   .floor_um = floor_um};
    remainder_t remainder = {0};
    take_columns(&c, simulated);
    look_at_bands(&c, &remainder);
    remainder.at_levels = look_at_levels(&c, simulated, &remainder);
    remainder.outliers = count_outliers(&c);
    remainder.structured = !remainder_knows_noise(samples, noise) || remainder.at_levels ||
                           remainder.rms_um > threshold.worth_mentioning * noise->rms_um + floor_um +
                                                  threshold.wrong_altogether * samples_rms(samples, effect) ||
                           (double)remainder.outliers > threshold.few_outliers ||
                           more_than_noise(&c, SAMPLE_HELD_OUT) || more_than_noise(&c, SAMPLE_FITTED);
    free(c.left);
    free(c.white);
    free(c.found_white);
    return remainder;
}
