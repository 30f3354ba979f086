/* SPDX-License-Identifier: MIT */
#include "modified_play_models.h"
#include "unity.h"
#include <math.h>

static hyst_q28_t q28(double x) {
    return (hyst_q28_t)lround(x * HYST_Q28_ONE);
}

static double either_sign(random_t *random) {
    return 2.0 * random_unit(random) - 1.0;
}

/* One real pole and a pair, or a third of the time no filter at all. Returns 1 - c1 - c2 - c3. */
static double random_filter(random_t *random, hyst_modified_play_parameters_t *p) {
    if (random_unit(random) < 0.3) {
        return 1.0;
    }
    const double pole = 0.98 * either_sign(random);
    const double radius = 0.98 * random_unit(random);
    const double twice = 2.0 * radius * cos(3.14 * random_unit(random));
    p->feedback[0] = q28(pole + twice);
    p->feedback[1] = q28(-(radius * radius + pole * twice));
    p->feedback[2] = q28(pole * radius * radius);
    return (1.0 - pole) * (1.0 - twice + radius * radius);
}

hyst_modified_play_parameters_t modified_play_random(random_t *random, hyst_modified_play_t *model) {
    hyst_modified_play_parameters_t p = {.divisions =
                                             1U + (uint32_t)(random_bits(random) % HYST_MODIFIED_PLAY_MAX_DIVISIONS),
                                         .offset = random_q31(random) / 32,
                                         .phase = (uint32_t)random_bits(random),
                                         .phase_step = (uint32_t)random_bits(random) >> (random_bits(random) % 20U)};
    const double gain = random_filter(random, &p);
    const double direct = fmax(0.002, fmin(1.0, gain) * (0.1 + 0.6 * random_unit(random)));
    p.direct = q28(direct);
    for (uint32_t cell = 0; cell < HYST_MODIFIED_PLAY_CELLS(p.divisions); cell++) {
        p.slope[cell] = q28(2.0 * direct * either_sign(random));
    }
    double feedback = direct * random_unit(random);
    p.bilinear = q28(feedback * either_sign(random));
    for (int i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
        p.sine[i] = q28(0.1 * feedback * either_sign(random));
        p.cosine[i] = q28(0.1 * feedback * either_sign(random));
    }
    if (random_unit(random) < 0.6) {
        p.alpha = (hyst_q20_t)(exp(8.0 * random_unit(random) - 3.0) * HYST_Q20_ONE);
        p.beta = random_unit(random) < 0.2 ? 0 : (hyst_q20_t)(exp(8.0 * random_unit(random) - 3.0) * HYST_Q20_ONE);
        p.rate_gain = (hyst_q30_t)((0.01 + 0.99 * random_unit(random)) * HYST_Q30_ONE);
    }
    /* Each refusal halves what it is about. */
    for (int attempt = 0; attempt < 200; attempt++) {
        uint32_t element = 0;
        switch (hyst_modified_play_build(model, &p, &element)) {
        case HYST_MODIFIED_PLAY_OK:
            return p;
        case HYST_MODIFIED_PLAY_TOO_FLAT:
        case HYST_MODIFIED_PLAY_TOO_STEEP:
        case HYST_MODIFIED_PLAY_WEIGHTS_TOO_LARGE:
            for (uint32_t cell = 0; cell < HYST_MODIFIED_PLAY_CELLS(p.divisions); cell++) {
                p.slope[cell] = p.slope[cell] / 4 * 3;
            }
            break;
        case HYST_MODIFIED_PLAY_FILTER_UNSTABLE:
        case HYST_MODIFIED_PLAY_INVERSE_UNSTABLE:
            p.bilinear = p.bilinear / 4 * 3;
            p.alpha = p.alpha / 4 * 3;
            p.beta = p.beta / 4 * 3;
            for (int i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
                p.sine[i] = p.sine[i] / 4 * 3;
                p.cosine[i] = p.cosine[i] / 4 * 3;
            }
            break;
        default:
            TEST_FAIL_MESSAGE("the generator makes what no pulling in repairs");
        }
    }
    TEST_FAIL_MESSAGE("the generator does not come to an end");
    return p;
}

hyst_modified_play_parameters_t modified_play_plain(double direct, double cell_slope) {
    hyst_modified_play_parameters_t p = {.divisions = 10, .direct = q28(direct), .rate_gain = HYST_Q30_ONE};
    for (uint32_t cell = 0; cell < HYST_MODIFIED_PLAY_CELLS(p.divisions); cell++) {
        p.slope[cell] = q28(cell_slope);
    }
    return p;
}

hyst_modified_play_t modified_play_accept(const hyst_modified_play_parameters_t *p) {
    hyst_modified_play_t model;
    uint32_t element = 0;
    TEST_ASSERT_EQUAL_INT_MESSAGE(HYST_MODIFIED_PLAY_OK, hyst_modified_play_build(&model, p, &element),
                                  "the test's model must be accepted");
    return model;
}

reference_play_t reference_play(const hyst_modified_play_parameters_t *parameters) {
    return (reference_play_t){.p = *parameters, .phase = parameters->phase};
}

void reference_play_copy(reference_play_t *r, const hyst_modified_play_state_t *state) {
    for (uint32_t i = 0; i + 1U < r->p.divisions; i++) {
        r->play[i] = state->play[i] * 0x1p-31L;
    }
    for (int i = 0; i < HYST_MODIFIED_PLAY_FEEDBACK; i++) {
        r->position[i] = state->position[i] * 0x1p-31L;
    }
    r->drive = state->drive * 0x1p-31L;
    r->rate = state->rate * 0x1p-30L;
    r->phase = state->phase;
}

/* The library's 1 / N is rounded down to a unit. */
static long double pitch_of(const reference_play_t *r) {
    return (long double)(INT32_MAX / (int32_t)r->p.divisions) * 0x1p-31L;
}

long double reference_play_share(const reference_play_t *r) {
    const long double pitch = pitch_of(r);
    const int n = (int)r->p.divisions;
    long double sum = 0.0L;
    uint32_t cell = 0;
    for (int i = 1; i < n; i++) {
        for (int j = 0; j < n - i; j++) {
            const long double center = (2 * j + 1 - (n - i)) * pitch;
            const long double weight = r->p.slope[cell++] * 0x1p-28L * pitch;
            sum += weight * fmaxl(-1.0L, fminl(1.0L, (r->play[i - 1] - center) / pitch));
        }
    }
    return sum;
}

long double reference_play_forward(reference_play_t *r, long double drive) {
    const hyst_modified_play_parameters_t *p = &r->p;
    const long double u = r->drive;
    const long double angle = 2.0L * acosl(-1.0L) * r->phase * 0x1p-32L;
    const long double rate = fabsl(r->rate);
    long double y = p->offset * 0x1p-31L + p->direct * 0x1p-28L * drive + p->bilinear * 0x1p-28L * r->position[0] * u;
    for (int i = 0; i < HYST_MODIFIED_PLAY_FEEDBACK; i++) {
        y += p->feedback[i] * 0x1p-28L * r->position[i];
    }
    for (int i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
        y += powl(u, 2 * i + 1) * (p->sine[i] * 0x1p-28L * sinl(angle) + p->cosine[i] * 0x1p-28L * cosl(angle));
    }
    for (uint32_t i = 0; i + 1U < p->divisions; i++) {
        const long double threshold = (i + 1U) * pitch_of(r);
        const long double low = drive - threshold - p->alpha * 0x1p-20L * rate;
        const long double high = drive + threshold + p->beta * 0x1p-20L * rate;
        r->play[i] = fmaxl(low, fminl(high, r->play[i]));
    }
    y += reference_play_share(r);
    const long double gain = p->alpha > 0 || p->beta > 0 ? p->rate_gain * 0x1p-30L : 1.0L;
    r->rate += gain * (drive - u - r->rate);
    r->drive = drive;
    r->phase += p->phase_step;
    r->position[2] = r->position[1];
    r->position[1] = r->position[0];
    r->position[0] = y;
    return y;
}

long double reference_play_inverse(reference_play_t *r, long double position) {
    long double low = -1.0L;
    long double high = 1.0L;
    for (int k = 0; k < 70; k++) {
        const long double middle = (low + high) / 2.0L;
        reference_play_t probe = *r;
        if (reference_play_forward(&probe, middle) < position) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (void)reference_play_forward(r, low);
    return low;
}
