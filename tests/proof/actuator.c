/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "actuator.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *source_name(source_t source) {
    static const char *const name[SOURCE_COUNT] = {"play density", "Bouc-Wen", "Preisach plane"};
    return name[source];
}

static double between(random_t *random, double low, double high) {
    return low + (high - low) * random_unit(random);
}

actuator_t actuator_draw(source_t source, random_t *random) {
    static const double low_v[] = {0.0, 0.0, -20.0}, high_v[] = {100.0, 150.0, 120.0};
    const size_t range = (size_t)random_between(random, 0, 2);
    actuator_t actuator = {.source = source,
                           .low_v = low_v[range],
                           .high_v = high_v[range],
                           .um_per_half_range = between(random, 4.0, 10.0),
                           .density_scale = between(random, 0.2, 0.6),
                           .hysteretic = between(random, 0.2, 0.35),
                           .curvature = between(random, -0.5, 0.5),
                           .exponent = between(random, 1.0, 2.0),
                           .from_above = random_unit(random) < 0.5};
    const double limit = between(random, 0.3, 0.5); /* of the Bouc-Wen state */
    const double sum = pow(limit, -actuator.exponent), share = between(random, 0.6, 0.9);
    actuator.beta = share * sum;
    actuator.gamma = (1.0 - share) * sum;
    actuator.offset_um = actuator.um_per_half_range * between(random, 0.8, 1.2);
    actuator.noise_um = 2.0 * actuator.um_per_half_range * between(random, 0.0004, 0.0008);
    actuator.converter_step_um = 2.4 * actuator.um_per_half_range / 65536.0;
    return actuator;
}

/* In what follows the drive and all half widths are fractions of half the range. */

typedef struct {
    double weight[PLAYS], half_width[PLAYS], position[PLAYS];
} bank_t;

static double plays(bank_t *bank, double drive, double growth) {
    double sum = 0.0;
    for (size_t i = 0; i < PLAYS; i++) {
        const double width = bank->half_width[i] + growth, below = drive - width, above = drive + width;
        double z = bank->position[i];
        z = z < below ? below : z;
        z = z > above ? above : z;
        bank->position[i] = z;
        sum += bank->weight[i] * z;
    }
    return sum;
}

static void move_plays(const actuator_t *actuator, const double *growth, double *value, size_t instants) {
    bank_t bank = {.position = {0.0}};
    double sum = 0.0;
    for (size_t i = 0; i < PLAYS; i++) {
        bank.half_width[i] = ((double)i + 0.5) / PLAYS;
        sum += bank.weight[i] = exp(-bank.half_width[i] / actuator->density_scale);
    }
    for (size_t i = 0; i < PLAYS; i++) {
        bank.weight[i] *= actuator->hysteretic / sum;
    }
    plays(&bank, actuator->from_above ? -1.0 : 1.0, 0.0);
    plays(&bank, actuator->from_above ? 1.0 : -1.0, 0.0);
    for (size_t k = 0; k < instants; k++) {
        value[k] = (1.0 - actuator->hysteretic) * value[k] + plays(&bank, value[k], growth != NULL ? growth[k] : 0.0);
    }
}

/* Slope of the state against the drive. */
static double bouc_wen_slope(const actuator_t *actuator, double state, double direction) {
    const double sign = state * direction >= 0.0 ? 1.0 : -1.0;
    return 1.0 - (actuator->gamma + actuator->beta * sign) * pow(fabs(state), actuator->exponent);
}

/* The state follows the drive by `change`. */
static double bouc_wen(const actuator_t *actuator, double state, double change) {
    const double a = bouc_wen_slope(actuator, state, change),
                 b = bouc_wen_slope(actuator, state + 0.5 * change * a, change),
                 c = bouc_wen_slope(actuator, state + 0.5 * change * b, change),
                 d = bouc_wen_slope(actuator, state + change * c, change);
    return state + change * (a + 2.0 * b + 2.0 * c + d) / 6.0;
}

static void move_bouc_wen(const actuator_t *actuator, double *value, size_t instants) {
    enum { STEPS = 2000 };
    const double first = actuator->from_above ? -1.0 : 1.0, turn[] = {first, -first, value[0]};
    double state = 0.0, drive = 0.0;
    for (size_t i = 0; i < 3; i++) { /* the sweep before the recording */
        for (size_t k = 0; k < STEPS; k++) {
            state = bouc_wen(actuator, state, (turn[i] - drive) / STEPS);
        }
        drive = turn[i];
    }
    for (size_t k = 0; k < instants; k++) {
        state = bouc_wen(actuator, state, value[k] - drive);
        drive = value[k];
        value[k] = drive - actuator->hysteretic * state;
    }
}

/*
 * What the relays of a triangle of the plane add when all of them switch: those that switch on between `low` and `high`
 * and off above `low`. The density is exp(-r / rho) (1 + kappa c^2), with r half the width of the relay and c its
 * middle. With h = R - r, R half the side, the integral over c is 2 h (1 + kappa m^2) + 2 kappa h^3 / 3, and the
 * moments I_n of h^n exp(-r / rho) follow from each other: I_n = rho (R^n - n I_{n-1}).
 */
static double triangle(const actuator_t *actuator, double low, double high) {
    const double rho = actuator->density_scale, kappa = actuator->curvature;
    const double side = 0.5 * (high - low), middle = 0.5 * (high + low);
    const double zeroth = -rho * expm1(-side / rho), first = rho * (side - zeroth),
                 second = rho * (side * side - 2.0 * first), third = rho * (side * side * side - 3.0 * second);
    return 2.0 * (first * (1.0 + kappa * middle * middle) + kappa * third / 3.0);
}

/* The line between the relays that are on and those that are off is a staircase: its corners, maxima and minima in
 * turn, narrowing. The lowest voltage is a minimum that nothing wipes out. */
enum { CORNERS = 4096 };
typedef struct {
    double corner[CORNERS]; /* even: minima, odd: maxima */
    double below[CORNERS];  /* position at that corner */
    size_t count;
} plane_t;

static double level(const plane_t *plane) {
    return plane->below[plane->count - 1];
}

static void push(const actuator_t *actuator, plane_t *plane, double corner) {
    if (plane->count == CORNERS) {
        fputs("proof: the staircase of the plane has too many corners\n", stderr);
        exit(EXIT_FAILURE);
    }
    const double from = plane->corner[plane->count - 1];
    const double change = triangle(actuator, fmin(from, corner), fmax(from, corner));
    plane->below[plane->count] = level(plane) + (corner > from ? change : -change);
    plane->corner[plane->count++] = corner;
}

/* All relays that switch on at or below `to` are on. */
static void rise(const actuator_t *actuator, plane_t *plane, double to) {
    const bool at_minimum = plane->count % 2 == 1;
    if (!at_minimum) { /* the present maximum moves */
        if (plane->corner[plane->count - 1] >= to) {
            return;
        }
        plane->count--;
    } else if (plane->corner[plane->count - 1] >= to) {
        return;
    }
    while (plane->count >= 3 && plane->corner[plane->count - 2] <= to) {
        plane->count -= 2;
    }
    push(actuator, plane, to);
}

/* All relays that switch off at or above `to` are off. */
static void fall(const actuator_t *actuator, plane_t *plane, double to) {
    const bool at_maximum = plane->count % 2 == 0;
    if (!at_maximum) {
        if (plane->count == 1 || plane->corner[plane->count - 1] <= to) {
            return;
        }
        plane->count--;
    } else if (plane->corner[plane->count - 1] <= to) {
        return;
    }
    while (plane->count >= 4 && plane->corner[plane->count - 2] >= to) {
        plane->count -= 2;
    }
    push(actuator, plane, to);
}

static void move_plane(const actuator_t *actuator, const double *growth, double *value, size_t instants) {
    plane_t *plane = proof_allocate(1, sizeof *plane);
    const double whole = triangle(actuator, -1.0, 1.0);
    plane->corner[0] = -3.0; /* below every voltage: no relay of the staircase lies there */
    plane->count = 1;
    rise(actuator, plane, 1.0);
    if (!actuator->from_above) {
        fall(actuator, plane, -1.0);
    }
    for (size_t k = 0; k < instants; k++) {
        const double width = growth != NULL ? growth[k] : 0.0;
        rise(actuator, plane, value[k] - width);
        fall(actuator, plane, value[k] + width);
        value[k] = (1.0 - actuator->hysteretic) * value[k] + 2.0 * actuator->hysteretic * level(plane) / whole;
    }
    free(plane);
}

void actuator_move(const actuator_t *actuator, const double *growth_v, double *voltage_v, size_t instants) {
    const double middle_v = 0.5 * (actuator->high_v + actuator->low_v),
                 half_v = 0.5 * (actuator->high_v - actuator->low_v);
    double *growth = growth_v != NULL ? proof_allocate(instants, sizeof *growth) : NULL;
    double *value = voltage_v;
    for (size_t k = 0; k < instants; k++) {
        value[k] = (voltage_v[k] - middle_v) / half_v;
        if (growth != NULL) {
            growth[k] = growth_v[k] / half_v;
        }
    }
    switch (actuator->source) {
    case SOURCE_PLAY:
        move_plays(actuator, growth, value, instants);
        break;
    case SOURCE_BOUC_WEN:
        move_bouc_wen(actuator, value, instants);
        break;
    default:
        move_plane(actuator, growth, value, instants);
        break;
    }
    free(growth);
    for (size_t k = 0; k < instants; k++) {
        value[k] = actuator->offset_um + actuator->um_per_half_range * value[k];
    }
}
