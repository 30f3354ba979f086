/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "operator/pink.h"
#include "base/failure.h"
#include <gsl/gsl_math.h>
#include <math.h>

/* Sections a decade of frequency: the slope ripples by 3 %. */
static const double per_decade = 2.0;

void pink_create(pink_t *pink, double rho, size_t samples) {
    *pink = (pink_t){.rho = rho};
    const double step = pow(10.0, 1.0 / per_decade), slowest = 0.5 / (double)samples;
    double f = rho;
    while (f > slowest && pink->sections < PINK_SECTIONS) {
        pink->pole[pink->sections] = exp(-2.0 * M_PI * f);
        pink->zero[pink->sections++] = exp(-2.0 * M_PI * f / sqrt(step));
        f /= step;
    }
}

double *pink_memory(const pink_t *pink) {
    return pink->sections > 0 ? allocate(2 * pink->sections, sizeof(double)) : NULL;
}

void pink_value(const pink_t *pink, double *memory, double *value, int first) {
    for (size_t i = 0; i < pink->sections; i++) {
        const double zero = pink->zero[i], pole = pink->pole[i], now = *value;
        double *in = memory + 2 * i, *out = in + 1;
        *value = first != 0 ? now * ((1.0 - zero) / (1.0 - pole)) : now - zero * *in + pole * *out;
        *in = now;
        *out = *value;
    }
}

/* Partial fractions of the product of all sections: 1 + sum share z^-1 / (1 - pole z^-1). */
static double share_of(const pink_t *pink, size_t i) {
    double share = pink->pole[i] - pink->zero[i];
    for (size_t j = 0; j < pink->sections; j++) {
        share *= j != i ? (pink->pole[i] - pink->zero[j]) / (pink->pole[i] - pink->pole[j]) : 1.0;
    }
    return share;
}

state_space_t pink_states(const pink_t *pink) {
    state_space_t filter = state_space_identity();
    filter.states = pink->sections;
    for (size_t i = 0; i < pink->sections; i++) {
        filter.a[i][i] = pink->pole[i];
        filter.b[i] = 1.0;
        filter.c[i] = share_of(pink, i);
    }
    return filter;
}
