/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "seed_002_memory.h"
#include "chain/chain.h"
#include "twins/twin_002.h"
#include <math.h>
#include <stdlib.h>

/* 10 V/s. */
enum { SAMPLES_PER_VOLT = 20 };
static const double rate_hz = 200.0;

/* Anything that takes a drive. */
typedef struct {
    void *state; /* at rest at 0 V */
    double (*step)(void *state, double drive_v);
} subject_t;

/* Both are 0 for a Preisach model. */
typedef struct {
    /* The difference that an inner loop makes, 50 to 30 V on the way from 20 to 65 V, once its upper end is passed. */
    double wiping_um;
    /* The largest difference between the loops from 30 to 40 V and back that come after 0 V and after 70 V, each
     * counted from its first point, in % of such a loop's stroke. */
    double congruency_percent;
} properties_t;

enum { LOOP_LOW_V = 30, LOOP_HIGH_V = 40, LOOP = 2 * (LOOP_HIGH_V - LOOP_LOW_V) * SAMPLES_PER_VOLT };

/* In a straight line. Writes the positions on the way to *position, if there is room wanted. Returns the last one. */
static double move(subject_t subject, int from_v, int to_v, double *position) {
    const int samples = abs(to_v - from_v) * SAMPLES_PER_VOLT;
    double last = 0.0;
    for (int k = 1; k <= samples; k++) {
        last = subject.step(subject.state, from_v + (double)(to_v - from_v) * k / samples);
        if (position != NULL) {
            position[k - 1] = last;
        }
    }
    return last;
}

static double after(subject_t subject, const int *corner_v, size_t corners) {
    double last = 0.0;
    for (size_t i = 0; i < corners; i++) {
        last = move(subject, i == 0 ? 0 : corner_v[i - 1], corner_v[i], NULL);
    }
    return last;
}

/* The loop that begins at its lower end, after these corners. */
static void loop_after(subject_t subject, const int *corner_v, size_t corners, double position[LOOP]) {
    const double start = after(subject, corner_v, corners);
    move(subject, LOOP_LOW_V, LOOP_HIGH_V, position);
    move(subject, LOOP_HIGH_V, LOOP_LOW_V, position + LOOP / 2);
    for (size_t k = 0; k < LOOP; k++) {
        position[k] -= start;
    }
}

/* Of four new subjects. */
static properties_t find_properties(const subject_t subject[4]) {
    static const int straight[] = {70, 20, 65}, inner[] = {70, 20, 50, 30, 65};
    static const int from_below[] = {LOOP_HIGH_V, LOOP_LOW_V}, from_above[] = {70, LOOP_LOW_V};
    double below[LOOP], above[LOOP], low = HUGE_VAL, high = -HUGE_VAL;
    properties_t properties = {0};
    properties.wiping_um = fabs(after(subject[0], straight, sizeof straight / sizeof straight[0]) -
                                after(subject[1], inner, sizeof inner / sizeof inner[0]));
    loop_after(subject[2], from_below, 2, below);
    loop_after(subject[3], from_above, 2, above);
    for (size_t k = 0; k < LOOP; k++) {
        low = fmin(low, below[k]);
        high = fmax(high, below[k]);
    }
    for (size_t k = 0; k < LOOP; k++) {
        properties.congruency_percent =
            fmax(properties.congruency_percent, 100.0 * fabs(below[k] - above[k]) / (high - low));
    }
    return properties;
}

static double step_twin(void *state, double drive_v) {
    return twin_002_step(state, drive_v);
}

static properties_t of_twin(const twin_002_numbers_t *numbers) {
    static twin_002_t twin[4];
    subject_t subject[4];
    for (size_t i = 0; i < 4; i++) {
        twin_002_open(&twin[i], numbers, rate_hz, 1);
        subject[i] = (subject_t){&twin[i], step_twin};
    }
    return find_properties(subject);
}

static double step_chain(void *state, double drive_v) {
    return chain_step(state, drive_v);
}

static bool of_model(const model_t *model, properties_t *properties, failure_t *failure) {
    subject_t subject[4] = {{0}};
    bool good = true;
    for (size_t i = 0; good && i < 4; i++) {
        chain_t *chain = chain_open(model, rate_hz, 1, failure);
        good = chain != NULL;
        if (good) {
            chain_settle(chain, 0.0);
            subject[i] = (subject_t){chain, step_chain};
        }
    }
    if (good) {
        *properties = find_properties(subject);
    }
    for (size_t i = 0; i < 4; i++) {
        chain_close(subject[i].state);
    }
    return good;
}

bool describe_memory_002(reproduction_t *reproduction, const model_t *model, failure_t *failure) {
    twin_002_numbers_t ceramic = twin_002_actuator;
    properties_t of_this_model;
    ceramic.cutoff_hz = 1e9;
    for (size_t j = 0; j < TWIN_002_RELAXATIONS; j++) {
        ceramic.part[j] = 0.0;
    }
    const properties_t whole = of_twin(&twin_002_actuator), alone = of_twin(&ceramic);
    if (!of_model(model, &of_this_model, failure)) {
        return false;
    }
    reproduction_text(
        reproduction,
        "**Wiping out and congruency**, at 10 V/s. An inner loop from 50 to 30 V leaves, once it is passed, %.1g um "
        "behind in the Preisach model and %.1g um in the twin's ceramic; with lag and relaxations %.2g um stay for a "
        "while. Loops between 30 and 40 V, reached from below and from above, differ by %.1g %% of their stroke in "
        "the model, by %.1g %% in the ceramic and by %.2g %% in the twin as it is: so much of it no Preisach model "
        "can know.",
        of_this_model.wiping_um, alone.wiping_um, whole.wiping_um, of_this_model.congruency_percent,
        alone.congruency_percent, whole.congruency_percent);
    return true;
}
