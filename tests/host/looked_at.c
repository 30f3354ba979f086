/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "looked_at.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>
#include <string.h>

enum { BEFORE = 32, FINE = (SCENE_SAMPLES + 2 * BEFORE) * SCENE_FINER, TONES = 9, SLOW_TONES = 300 };
const double scene_rate_hz = 1000.0;
static const double rest_s = 0.5, begin_v = 50.0;

static double drive_at(size_t which, double t, const double *phase) {
    const double end_s = (double)SCENE_SAMPLES / scene_rate_hz - rest_s, begin = fmin(1.0, t / 0.1);
    double x = 0.0;
    t = fmin(t, end_s - rest_s);
    switch (which) {
    case 0:
        x = 0.7 * sin(2.0 * M_PI * t) + 0.4 * sin(2.0 * M_PI * 3.0 * t + 0.5) - 0.4 * sin(0.5) * exp(-t / 0.05);
        break;
    case 1:
        x = (0.55 + 0.4 * cos(2.0 * M_PI * t / 9.0)) * 2.0 / M_PI * asin(sin(2.0 * M_PI * 2.3 * t));
        break;
    default:
        for (size_t i = 0; i < TONES; i++) {
            x += 0.3 * sin(2.0 * M_PI * (0.43 + 0.71 * (double)i) * t + phase[i]);
        }
        x *= begin;
        break;
    }
    return begin_v + 40.0 * x;
}

/* The position that this drive makes. */
static void follow(scene_t *scene) {
    double z = 0.0;
    for (size_t k = 0; k < FINE; k++) {
        if (k > 0) {
            const double way = scene->drive[k] - scene->drive[k - 1], limit = way > 0.0 ? 8.0 : -8.0;
            z = limit + (z - limit) * exp(-fabs(way) / 8.0);
        }
        scene->position[k] = 0.1 * (scene->drive[k] - 0.6 * z);
    }
}

void scene_open(scene_t *scene, size_t which, random_t *random) {
    double phase[TONES];
    for (size_t i = 0; i < TONES; i++) {
        phase[i] = 2.0 * M_PI * random_unit(random);
    }
    scene->drive = allocate(FINE, sizeof *scene->drive);
    scene->position = allocate(FINE, sizeof *scene->position);
    scene->noise_um = 0.005;
    scene->slow_um = 0.0;
    for (size_t k = 0; k < FINE; k++) {
        const double t = ((double)k / SCENE_FINER - BEFORE) / scene_rate_hz - rest_s;
        scene->drive[k] = t > 0.0 ? drive_at(which, t, phase) : begin_v;
    }
    follow(scene);
}

void scene_hold(scene_t *scene, size_t samples) {
    for (size_t k = 0; k < FINE; k++) {
        scene->drive[k] = scene->drive[k - k % (samples * SCENE_FINER)];
    }
    follow(scene);
}

void scene_close(scene_t *scene) {
    free(scene->drive);
    free(scene->position);
}

double scene_position(const scene_t *scene, double at) {
    const double fine = (at + BEFORE) * SCENE_FINER;
    const size_t k = (size_t)fmin(FINE - 2.0, fmax(0.0, floor(fine)));
    const double x = fine - (double)k;
    return scene->position[k] + x * (scene->position[k + 1] - scene->position[k]);
}

void scene_round(double *column, size_t samples) {
    for (size_t k = 0; k < samples; k++) {
        column[k] = round(column[k] * 1e5) / 1e5;
    }
}

void scene_record(const scene_t *scene, const double *late_samples, random_t *random, recording_t *recording) {
    recording_create(recording, "scene.csv", scene_rate_hz, SCENE_SAMPLES);
    for (size_t k = 0; k < SCENE_SAMPLES; k++) {
        const double late = late_samples == NULL ? 0.0 : late_samples[k];
        recording->column[COLUMN_DRIVE][k] = scene->drive[(k + BEFORE) * SCENE_FINER];
        recording->column[COLUMN_DISPLACEMENT][k] =
            scene_position(scene, (double)k - late) + scene->noise_um * random_normal(random);
    }
    /* Tones whose distances are their frequencies: 1 / f. */
    const double ratio = pow(0.5 * scene_rate_hz / 0.05, 1.0 / SLOW_TONES);
    double f = 0.05;
    for (size_t i = 0; scene->slow_um > 0.0 && i < SLOW_TONES; i++) {
        const double phase = 2.0 * M_PI * random_unit(random), size = scene->slow_um * sqrt(2.0 / SLOW_TONES);
        for (size_t k = 0; k < SCENE_SAMPLES; k++) {
            recording->column[COLUMN_DISPLACEMENT][k] += size * sin(2.0 * M_PI * f * (double)k / scene_rate_hz + phase);
        }
        f *= ratio;
    }
    scene_round(recording->column[COLUMN_DRIVE], SCENE_SAMPLES);
    scene_round(recording->column[COLUMN_DISPLACEMENT], SCENE_SAMPLES);
}
