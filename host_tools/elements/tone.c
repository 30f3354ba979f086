/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/tone.h"
#include <gsl/gsl_math.h>

/* A vector that turns by the same angle at each sample. Each turn rounds it, so it is made anew every so often: it
 * stays within 1e-13 of the sine (tests/host/test_effects.c). */
enum { MADE_ANEW = 256 };

void tone_open(tone_t *tone, double frequency_hz, double sample_rate_hz, double clock_s, size_t harmonics,
               const double *part) {
    *tone =
        (tone_t){.turns_per_sample = frequency_hz / sample_rate_hz, .turns = remainder(frequency_hz * clock_s, 1.0)};
    tone->turn_cos = cos(2.0 * M_PI * remainder(tone->turns_per_sample, 1.0));
    tone->turn_sin = sin(2.0 * M_PI * remainder(tone->turns_per_sample, 1.0));
    for (size_t h = 1; h <= harmonics; h++) {
        const double cosine = part[2 * h - 2], sine = part[2 * h - 1];
        if ((h == 1 || (double)h * tone->turns_per_sample < 0.5) && (cosine != 0.0 || sine != 0.0)) {
            tone->part[2 * h - 2] = cosine;
            tone->part[2 * h - 1] = sine;
            tone->harmonics = h;
        }
    }
}

void tone_settle(tone_t *tone) {
    tone->samples = 0;
}

static void make_anew(tone_t *tone) {
    const double samples = (double)tone->samples, all = tone->turns_per_sample * samples;
    const double lost = fma(tone->turns_per_sample, samples, -all); /* by rounding `all` */
    const double angle = 2.0 * M_PI * (fmod(all, 1.0) + lost + tone->turns);
    tone->now_cos = cos(angle);
    tone->now_sin = sin(angle);
}

double tone_next(tone_t *tone) {
    if (tone->samples % MADE_ANEW == 0) {
        make_anew(tone);
    }
    tone->samples++;
    const double one_cos = tone->now_cos, one_sin = tone->now_sin;
    double sum = 0.0, c = one_cos, s = one_sin;
    for (size_t i = 0; i < 2 * tone->harmonics; i += 2) {
        sum += tone->part[i] * c + tone->part[i + 1] * s;
        const double next = c * one_cos - s * one_sin;
        s = s * one_cos + c * one_sin;
        c = next;
    }
    tone->now_cos = one_cos * tone->turn_cos - one_sin * tone->turn_sin;
    tone->now_sin = one_cos * tone->turn_sin + one_sin * tone->turn_cos;
    return sum;
}
