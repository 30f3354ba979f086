/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "measured_actuator.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

enum { FINER = 8, OPERATORS = 60, REST = 400, LONGEST_DELAY = 64 };
static const double rate_hz = 2000.0, capacitance_f = 1e-6, leakage_s = 1e-7;

/* A line to a level, then a rest, both in samples. Returns the instant at which it ends. */
static size_t go_to(double *drive, size_t instants, size_t at, double level_v, size_t line, size_t rest) {
    const double from = at > 0 ? drive[at - 1] : 0.0;
    for (size_t k = 0; k < (line + rest) * FINER && at < instants; k++, at++) {
        drive[at] = k < line * FINER ? from + (level_v - from) * (double)(k + 1) / (double)(line * FINER) : level_v;
    }
    return at;
}

/* At FINER instants a sample, of which the last one is the sample's. */
static void fill_drive(double *drive, size_t samples) {
    static const double level[] = {20.0, 85.0, 35.0, 70.0, 45.0, 0.0}, step[] = {60.0, 20.0, 90.0, 50.0};
    const size_t instants = samples * FINER;
    size_t at = go_to(drive, instants, 0, 0.0, 1, 200);
    at = go_to(drive, instants, at, 100.0, 500, 0);
    at = go_to(drive, instants, at, 0.0, 500, REST);
    for (size_t i = 0; i < 6; i++) {
        at = go_to(drive, instants, at, level[i], 250, 0);
    }
    for (size_t i = 0; i < 4; i++) {
        at = go_to(drive, instants, at, step[i], 1, REST);
    }
    at = go_to(drive, instants, at, 100.0, 40, 0);
    for (size_t i = 0; i < 6; i++) {
        at = go_to(drive, instants, at, level[i], 40, 0);
    }
    at = go_to(drive, instants, at, 50.0, 100, REST);
    const size_t chirp = instants - at - REST * FINER;
    const double seconds = (double)chirp / (rate_hz * FINER), growth = log(200.0 / 5.0) / seconds;
    for (size_t k = 0; k < chirp; k++, at++) {
        const double t = (double)(k + 1) / (rate_hz * FINER);
        drive[at] = 50.0 + 5.0 * sin(2.0 * M_PI * 5.0 / growth * expm1(growth * t));
    }
    go_to(drive, instants, at, 50.0, 1, REST);
}

typedef struct {
    double past[LONGEST_DELAY];
    size_t at;
} delay_t;

static double delayed(delay_t *delay, double delay_s, double x, bool first) {
    const size_t steps = (size_t)lround(delay_s * rate_hz * FINER);
    for (size_t i = 0; first && i < LONGEST_DELAY; i++) {
        delay->past[i] = x;
    }
    delay->at = (delay->at + 1) % LONGEST_DELAY;
    delay->past[delay->at] = x;
    return delay->past[(delay->at + LONGEST_DELAY - steps) % LONGEST_DELAY];
}

/* One step by the trapezoidal rule; hz 0: none. */
typedef struct {
    double input, output;
} low_pass_t;

static double low_pass(low_pass_t *s, double hz, double x, bool first) {
    const double turn = M_PI * hz / (rate_hz * FINER);
    s->output = first || hz == 0.0 ? x : (s->output * (1.0 - turn) + turn * (x + s->input)) / (1.0 + turn);
    s->input = x;
    return s->output;
}

typedef struct {
    delay_t before, behind;
    low_pass_t amplifier, sensor, monitor;
    double slewed, play[OPERATORS];
} state_t;

static double amplify(const actuator_t *a, state_t *s, double drive, double t, bool first) {
    const double most = a->slew_v_per_s / (rate_hz * FINER);
    double v = low_pass(&s->amplifier, a->amplifier_hz, delayed(&s->before, a->amplifier_delay_s, drive, first), first);
    if (a->slew_v_per_s > 0.0) {
        s->slewed = first ? v : s->slewed + fmax(-most, fmin(most, v - s->slewed));
        v = s->slewed;
    }
    v = a->rail_v > 0.0 ? fmin(v, a->rail_v) : v;
    return v + a->ripple_v * sin(2.0 * M_PI * 3.3 * t) * sin(2.0 * M_PI * 0.7 * t);
}

static double move(state_t *s, double v) {
    double position = 1.0 + 0.09 * v;
    for (size_t i = 0; i < OPERATORS; i++) {
        const double r = 48.0 * (double)(i + 1) / OPERATORS;
        s->play[i] = fmax(v - r, fmin(v + r, s->play[i]));
        position += 0.0016 * exp(-0.033 * r) * s->play[i];
    }
    return position;
}

static double climate(climate_t kind, double t, double before, random_t *rng) {
    switch (kind) {
    case CYCLING_TEMPERATURE:
        return 25.0 + 0.5 * sin(2.0 * M_PI * t / 0.43 + 1.0);
    case WARMING_UP:
        return 26.0 - exp(-t / 4.0);
    case WANDERING_TEMPERATURE:
        return before + 0.02 * random_normal(rng);
    default:
        return 25.0;
    }
}

void measure_actuator(const actuator_t *a, const char *name, random_t *rng, recording_t *recording) {
    const double gain = a->monitor_gain > 0.0 ? a->monitor_gain : 1.0;
    recording_create(recording, name, rate_hz, a->samples);
    double *drive = recording->column[COLUMN_DRIVE], *displacement = recording->column[COLUMN_DISPLACEMENT];
    double *voltage = a->voltage ? recording_add_column(recording, COLUMN_VOLTAGE) : NULL;
    double *current = a->current ? recording_add_column(recording, COLUMN_CURRENT) : NULL;
    double *thermometer = a->temperature ? recording_add_column(recording, COLUMN_TEMPERATURE) : NULL;
    state_t s = {0};
    double room = 25.0, warmth = 0.0, v_before = 0.0, rise = 0.0;
    double *instant = calloc(a->samples * FINER, sizeof *instant);
    fill_drive(instant, a->samples);
    for (size_t k = 0; k < a->samples; k++) {
        double v = 0.0, position = 0.0, seen = 0.0;
        for (size_t step = 0; step < FINER; step++) {
            const double part = (double)(step + 1) / FINER;
            const bool first = k == 0 && step == 0;
            v = amplify(a, &s, instant[k * FINER + step], ((double)k + part) / rate_hz, first);
            position = low_pass(&s.sensor, a->sensor_hz, move(&s, v), first);
            position = delayed(&s.behind, a->sensor_delay_s, position, first);
            seen = low_pass(&s.monitor, a->monitor_hz, v, first);
            rise = first ? 0.0 : (v - v_before) * rate_hz * FINER;
            v_before = v;
        }
        drive[k] = instant[k * FINER + FINER - 1];
        const double t = (double)k / rate_hz, start = climate(a->climate, 0.0, 25.0, rng);
        room = k == 0 ? start : climate(a->climate, t, room, rng);
        warmth = a->actuator_warms_s > 0.0 && k > 0 ? warmth + (room - warmth) / (rate_hz * a->actuator_warms_s) : room;
        displacement[k] = position + a->um_per_kelvin * (warmth - 25.0) + a->drift_um * exp(-t / 1.5) +
                          a->noise_um * random_normal(rng);
        if (voltage != NULL) {
            voltage[k] = 0.3 + gain * seen + 0.01 * random_normal(rng);
        }
        if (current != NULL) {
            current[k] = capacitance_f * rise + leakage_s * v + 2e-6 * random_normal(rng);
        }
        if (thermometer != NULL) {
            thermometer[k] = 0.01 * round(100.0 * (room + 0.002 * random_normal(rng)));
        }
    }
    free(instant);
}
