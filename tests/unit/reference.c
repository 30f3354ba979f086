/* SPDX-License-Identifier: MIT */
#include "reference.h"
#include <math.h>

reference_pi_t reference_pi(const pi_arguments_t *a) {
    reference_pi_t m = {.operators = a->operators, .offset = a->offset * 0x1p-31L};
    for (uint32_t j = 0; j <= a->operators; j++) {
        m.weight[j] = a->weight[j] * 0x1p-28L;
    }
    for (uint32_t i = 0; i < a->operators; i++) {
        m.threshold[i] = a->threshold[i] * 0x1p-31L;
    }
    m.beta = a->beta * 0x1p-20L;
    m.rate_gain = a->rate_gain * 0x1p-30L;
    m.kappa_limit = INT32_MAX * 0x1p-31L - (a->operators > 0 ? m.threshold[a->operators - 1] : 0.0L);
    return m;
}

static long double evaluate(const reference_pi_t *m, long double drive, long double memory[]) {
    const long double kappa = fminl(m->beta * fabsl(m->rate), m->kappa_limit);
    long double position = m->offset + m->weight[0] * drive;
    for (uint32_t i = 0; i < m->operators; i++) {
        const long double r = m->threshold[i] + kappa;
        memory[i] = fmaxl(drive - r, fminl(drive + r, m->memory[i]));
        position += m->weight[i + 1] * memory[i];
    }
    return position;
}

long double reference_pi_forward(reference_pi_t *m, long double drive) {
    const long double position = evaluate(m, drive, m->memory);
    m->rate += m->rate_gain * (drive - m->drive - m->rate);
    m->drive = drive;
    return position;
}

long double reference_pi_inverse(reference_pi_t *m, long double position) {
    long double scratch[HYST_PI_MAX_OPERATORS];
    long double low = -1.0L;
    long double high = 1.0L;
    for (int k = 0; k < 70; k++) {
        const long double middle = (low + high) / 2.0L;
        if (evaluate(m, middle, scratch) < position) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (void)reference_pi_forward(m, low);
    return low;
}

reference_pi_t reference_pi_analytic_inverse(const reference_pi_t *m) {
    /* b_0 = 1 / a_0, b_i = 1 / S_i - 1 / S_{i-1}; s_1 = a_0 r_1, s_{i+1} - s_i = S_i (r_{i+1} - r_i). */
    reference_pi_t inverse = {.operators = m->operators, .rate_gain = 1.0L, .kappa_limit = 1.0L};
    long double slope = m->weight[0];
    long double threshold = 0.0L;
    long double previous = 0.0L;
    inverse.weight[0] = 1.0L / slope;
    for (uint32_t i = 0; i < m->operators; i++) {
        threshold += slope * (m->threshold[i] - previous);
        previous = m->threshold[i];
        inverse.threshold[i] = threshold;
        inverse.weight[i + 1] = 1.0L / (slope + m->weight[i + 1]) - 1.0L / slope;
        slope += m->weight[i + 1];
    }
    return inverse;
}
