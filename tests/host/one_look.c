/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "one_look.h"
#include "look/look_text.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <string.h>

const double rate_hz = 2000.0, errors = 4.0, mode_hz = 90.0;
random_t rng;
recording_t recording;
look_t look;
failure_t failure;

void setUp(void) {
    recording_create(&recording, "look.csv", rate_hz, SAMPLES);
}

void tearDown(void) {
    recording_free(&recording);
}

double *drive(void) {
    return recording.column[COLUMN_DRIVE];
}

double *position(void) {
    return recording.column[COLUMN_DISPLACEMENT];
}

void see(void) {
    TEST_ASSERT_TRUE(look_at(&recording, &look, &failure));
}

const char *said(void) {
    static char text[4000];
    const fault_list_t no_faults = {0};
    FILE *file = tmpfile();
    memset(text, 0, sizeof text);
    looks_print(file, &look, 1, &no_faults);
    rewind(file);
    TEST_ASSERT_TRUE(fread(text, 1, sizeof text - 1, file) > 0);
    fclose(file);
    return text;
}

void fill_levels(size_t hold) {
    double level = 50.0;
    for (size_t k = 0; k < SAMPLES; k++) {
        level = k % hold == 0 ? 10.0 + 80.0 * random_unit(&rng) : level;
        drive()[k] = level;
    }
}

/* y[k] = a y[k-1] + b y[k-2] + c u[k-1]: a mode at 90 Hz with damping 0.1, static gain 0.3. */
static const double mode_damping = 0.1;

static void mode_numbers(double *a, double *b, double *c) {
    const double w = 2.0 * M_PI * mode_hz / rate_hz, decay = exp(-mode_damping * w);
    *a = 2.0 * decay * cos(w * sqrt(1.0 - mode_damping * mode_damping));
    *b = -decay * decay;
    *c = 0.3 * (1.0 - *a - *b);
}

double complex mode_at(double f) {
    double a, b, c;
    mode_numbers(&a, &b, &c);
    const double complex z = cexp(-2.0 * M_PI * (double complex)I * f / rate_hz);
    return c * z / (1.0 - a * z - b * z * z);
}

void fill_with_mode(double noise_um) {
    double a, b, c, y1 = 0.0, y2 = 0.0;
    mode_numbers(&a, &b, &c);
    for (size_t k = 0; k < SAMPLES; k++) {
        const double y = a * y1 + b * y2 + (k > 0 ? c * drive()[k - 1] : 0.0);
        position()[k] = y + noise_um * random_normal(&rng);
        y2 = y1;
        y1 = y;
    }
}
