/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/where/locate.h"
#include "diagnosis/where/cells.h"
#include "diagnosis/where/drive_period.h"
#include "diagnosis/where/drive_rate.h"
#include "diagnosis/where/loop_parts.h"
#include "numerics/spectrum.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_math.h>
#include <math.h>
#include <stdlib.h>

enum { TIME_CELLS = 60, DRIVE_CELLS = 24, CELLS_PER_OCTAVE = 24, OCTAVES = 26 };

static double mean_square(const recording_t *r, const double *difference, size_t from) {
    double sum = 0.0;
    for (size_t k = from; k < r->samples; k++) {
        sum += difference[k] * difference[k];
    }
    return from < r->samples ? sum / (double)(r->samples - from) : 0.0;
}

static void locate_in_time(const recording_t *r, const double *difference, size_t from, double floor_um,
                           ranges_t *ranges) {
    cell_t cell[TIME_CELLS] = {0};
    const size_t samples = r->samples - from;
    for (size_t i = 0; i < TIME_CELLS; i++) {
        const size_t begin = from + samples * i / TIME_CELLS, end = from + samples * (i + 1) / TIME_CELLS;
        for (size_t k = begin; k < end; k++) {
            cell[i].energy += difference[k] * difference[k];
        }
        cell[i].energy = fmax(0.0, cell[i].energy - (double)(end - begin) * floor_um * floor_um);
        cell[i].from = r->start_s + (double)begin / r->sample_rate_hz;
        cell[i].to = r->start_s + (double)end / r->sample_rate_hz;
    }
    const double width = (double)samples / r->sample_rate_hz / TIME_CELLS;
    if ((double)cells_choose(cell, TIME_CELLS) > threshold.no_place * (double)TIME_CELLS) {
        *ranges = (ranges_t){.count = 1, .range = {{cell[0].from, cell[TIME_CELLS - 1].to}}};
    } else {
        cells_collect(cell, TIME_CELLS, cells_linear_gap, 1.5 * width, ranges);
    }
    ranges_note_whole(ranges, cell[0].from, cell[TIME_CELLS - 1].to);
}

static void locate_in_drive(const recording_t *recordings, size_t count, double *const *difference, const size_t *from,
                            double floor_um, ranges_t *ranges) {
    cell_t cell[DRIVE_CELLS] = {0};
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t i = 0; i < count; i++) {
        for (size_t k = from[i]; k < recordings[i].samples; k++) {
            low = fmin(low, recordings[i].column[COLUMN_DRIVE][k]);
            high = fmax(high, recordings[i].column[COLUMN_DRIVE][k]);
        }
    }
    const double width = (high - low) / DRIVE_CELLS;
    for (size_t i = 0; i < count; i++) {
        for (size_t k = from[i]; k < recordings[i].samples && width > 0.0; k++) {
            const double at = (recordings[i].column[COLUMN_DRIVE][k] - low) / width;
            const size_t c = at < DRIVE_CELLS ? (size_t)at : DRIVE_CELLS - 1;
            cell[c].visits += 1.0;
            cell[c].energy += difference[i][k] * difference[i][k];
        }
    }
    for (size_t c = 0; c < DRIVE_CELLS; c++) {
        cell[c].from = low + width * (double)c;
        cell[c].to = low + width * (double)(c + 1);
    }
    if (cells_have_no_place(cell, DRIVE_CELLS, floor_um)) {
        *ranges = (ranges_t){.count = 1, .range = {{low, high}}};
    } else {
        cells_collect(cell, DRIVE_CELLS, cells_linear_gap, 1.5 * width, ranges);
    }
    ranges_note_whole(ranges, low, high);
}

/* Cells of equal width in octaves, down from half of the highest sample rate; what lies below them is in the first. */
static void locate_in_frequency(const recording_t *recordings, size_t count, double *const *difference,
                                const size_t *from, double floor_um, ranges_t *ranges) {
    enum { CELLS = CELLS_PER_OCTAVE * OCTAVES };
    cell_t *cell = allocate(CELLS, sizeof *cell);
    double highest = 0.0;
    for (size_t i = 0; i < count; i++) {
        highest = fmax(highest, 0.5 * recordings[i].sample_rate_hz);
    }
    for (size_t i = 0; i < count; i++) {
        const double rate = recordings[i].sample_rate_hz;
        spectrum_t spectrum;
        spectrum_of(difference[i] + from[i], recordings[i].samples - from[i], rate, &spectrum);
        for (size_t f = 0; f < spectrum.count; f++) {
            const double hz = (double)f * spectrum.step_hz;
            const double octave = f == 0 ? 0.0 : OCTAVES + log2(hz / highest);
            const double at = CELLS_PER_OCTAVE * octave;
            const size_t c = at >= CELLS ? CELLS - 1 : at > 0.0 ? (size_t)at : 0;
            const double below = fmax(0.0, hz - 0.5 * spectrum.step_hz);
            cell[c].from = cell[c].to > 0.0 ? fmin(cell[c].from, below) : below;
            cell[c].to = fmax(cell[c].to, fmin(0.5 * rate, hz + 0.5 * spectrum.step_hz));
            cell[c].energy += spectrum.energy[f] - spectrum.white * floor_um * floor_um;
        }
        spectrum_free(&spectrum);
    }
    for (size_t c = 0; c < CELLS; c++) {
        cell[c].energy = fmax(0.0, cell[c].energy);
    }
    cells_choose(cell, CELLS);
    cells_collect(cell, CELLS, cells_octave_gap, log(threshold.one_range), ranges);
    /* From the lowest line on, whatever a twenty-fourth of the highest would be. */
    ranges_note_whole(ranges, 0.0, highest);
    ranges->whole = ranges->whole && ranges->range[0].from <= 0.0;
    free(cell);
}

static void find_harmonics(const recording_t *r, const double *difference, size_t from, location_t *location) {
    const double period = drive_period(r->column[COLUMN_DRIVE] + from, r->samples - from);
    if (period == 0.0) {
        return;
    }
    const size_t samples = (size_t)(floor((double)(r->samples - from) / period) * period);
    double mean = 0.0, variance = 0.0;
    for (size_t k = 0; k < samples; k++) {
        mean += difference[from + k] / (double)samples;
    }
    for (size_t k = 0; k < samples; k++) {
        variance += gsl_pow_2(difference[from + k] - mean) / (double)samples;
    }
    location->fundamental_hz = r->sample_rate_hz / period;
    for (unsigned h = 1; h <= 40 && 2.0 * h < period && location->harmonics < LOCATION_MOST_HARMONICS; h++) {
        double real = 0.0, imaginary = 0.0;
        for (size_t k = 0; k < samples; k++) {
            const double angle = 2.0 * M_PI * fmod((double)h * (double)k / period, 1.0);
            real += (difference[from + k] - mean) * cos(angle);
            imaginary += (difference[from + k] - mean) * sin(angle);
        }
        const double power = 2.0 * (real * real + imaginary * imaginary) / ((double)samples * (double)samples);
        if (power > threshold.least_harmonic * variance) {
            location->harmonic[location->harmonics++] = h;
        }
    }
}

void locate(const recording_t *recordings, size_t count, double *const *difference, const size_t *from, double floor_um,
            location_t *location) {
    double most = 0.0;
    *location = (location_t){0};
    for (size_t i = 0; i < count; i++) {
        const double above = mean_square(&recordings[i], difference[i], from[i]) - floor_um * floor_um;
        if (above > most) {
            most = above;
            location->recording = i;
            location->somewhere = true;
        }
    }
    if (location->somewhere) {
        const size_t i = location->recording;
        locate_in_time(&recordings[i], difference[i], from[i], floor_um, &location->time_s);
        locate_in_frequency(recordings, count, difference, from, floor_um, &location->frequency_hz);
        locate_in_drive(recordings, count, difference, from, floor_um, &location->drive_v);
        locate_in_rate(recordings, count, difference, from, floor_um, &location->drive_rate_v_per_s);
        find_harmonics(&recordings[i], difference[i], from[i], location);
        location->loop = find_loop_part(recordings, count, difference, from, floor_um);
    }
}
