/* SPDX-License-Identifier: MIT */
/* The modified play model against long double, its composition with both inverses, its memory, stability, extremes. */
#include "composition.h"
#include "modified_play_models.h"
#include "unity.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

typedef enum { REST, CREEP, RAMP, JUMP, CORNER, EXTREME, KINDS } kind_t;

static hyst_q31_t next_drive(const hyst_modified_play_t *model, const hyst_modified_play_state_t *state, kind_t kind,
                             hyst_q31_t ramp) {
    switch (kind) {
    case REST:
        return state->drive;
    case CREEP:
        return hyst_add(state->drive, random_between(&rng, -3, 3));
    case RAMP:
        return hyst_add(state->drive, ramp);
    case EXTREME:
        return random_unit(&rng) < 0.5 ? INT32_MIN : INT32_MAX;
    case CORNER: /* where a play begins to move (without the rate), and beside it */
        if (model->parameters.divisions > 1U) {
            const uint32_t row = (uint32_t)(random_bits(&rng) % (model->parameters.divisions - 1U));
            const int64_t r = (int64_t)(row + 1U) * model->pitch;
            return hyst_saturate(state->play[row] + (random_unit(&rng) < 0.5 ? r : -r) + random_between(&rng, -1, 1));
        }
        return 0;
    default:
        return random_q31(&rng);
    }
}

typedef struct {
    kind_t kind;
    hyst_q31_t ramp;
} walk_t;

static void change_sometimes(walk_t *walk) {
    if (random_unit(&rng) < 0.05) {
        walk->kind = (kind_t)(random_bits(&rng) % KINDS);
        walk->ramp = random_q31(&rng) >> (random_bits(&rng) % 31U);
    }
}

/*
 * From the same memory, one sample. Rounding costs: y 1/2; y u before g 1/2 |g|; the sine 5 and the rounding of powers
 * below 4, times sum |A| <= 1; the widening of the plays half a unit, times a slope of 4.
 */
static void test_each_sample_equals_long_double(void) {
    double worst = 0.0;
    for (int run = 0; run < 400; run++) {
        hyst_modified_play_t model;
        const hyst_modified_play_parameters_t p = modified_play_random(&rng, &model);
        reference_play_t reference = reference_play(&p);
        hyst_modified_play_state_t state;
        hyst_modified_play_reset(&model, &state, random_q31(&rng));
        walk_t walk = {.kind = JUMP, .ramp = 1};
        for (int k = 0; k < 500; k++) {
            change_sometimes(&walk);
            const hyst_q31_t drive = next_drive(&model, &state, walk.kind, walk.ramp);
            reference_play_copy(&reference, &state);
            const long double carried = state.remainder * 0x1p-28L;
            const long double exact = reference_play_forward(&reference, drive * 0x1p-31L) * 0x1p31L + carried;
            const hyst_q31_t got = hyst_modified_play_forward(&model, &state, drive);
            const double error = (double)fabsl(got - fmaxl(-0x1p31L, fminl(0x1p31L - 1.0L, exact)));
            worst = fmax(worst, error);
            TEST_ASSERT_TRUE(fabsl(state.rate * 0x1p-30L - reference.rate) <= 0x1p-30L);
            TEST_ASSERT_EQUAL_UINT32(reference.phase, state.phase);
        }
    }
    printf("one sample against long double: worst error %.2f * 2^-31\n", worst);
    TEST_ASSERT_TRUE(worst <= 12.0);
}

/* Sums of |h| and |h[k] - h[k-1]| over the response h of the filter c to a unit pulse. */
typedef struct {
    double gain, change;
} response_t;

static response_t response_of(const hyst_modified_play_parameters_t *p, double drive) {
    const double c1 = (p->feedback[0] + drive * p->bilinear) * 0x1p-28;
    response_t r = {0.0, 0.0};
    double h[] = {1.0, 0.0, 0.0};
    double before = 0.0;
    for (int k = 0; k < 5000; k++) {
        r.gain += fabs(h[0]);
        r.change += fabs(h[0] - before);
        before = h[0];
        const double next = c1 * h[0] + p->feedback[1] * 0x1p-28 * h[1] + p->feedback[2] * 0x1p-28 * h[2];
        h[2] = h[1];
        h[1] = h[0];
        h[0] = next;
    }
    return r;
}

/*
 * Left to itself for 2000 samples. What rounds within a sample (5 units of the sine, half a unit of u^3 .., times sum
 * |A| <= 1, half a unit of widening times a slope of at most 4) goes through the filter; so does, but as a difference,
 * the half unit of y that is carried on. Rest is known to a unit.
 */
static void test_free_run_follows_long_double(void) {
    double worst = 0.0;
    for (int run = 0; run < 100; run++) {
        hyst_modified_play_t model;
        hyst_modified_play_parameters_t p = modified_play_random(&rng, &model);
        p.bilinear = 0; /* then the filter is the same at every drive */
        model = modified_play_accept(&p);
        hyst_modified_play_state_t state;
        hyst_modified_play_reset(&model, &state, 0);
        reference_play_t reference = reference_play(&p);
        reference_play_copy(&reference, &state);
        const response_t response = response_of(&p, 0.0);
        const double bound = 10.0 * response.gain + 0.5 * response.change + 1.0;
        double error = 0.0;
        long double peak = 0.0L;
        for (int k = 1; k < 2000; k++) {
            const hyst_q31_t drive = (hyst_q31_t)lround(0x1p30 * sin(k * 0.02) * cos(k * 0.003));
            const long double y = reference_play_forward(&reference, drive * 0x1p-31L);
            peak = fmaxl(peak, fabsl(y));
            error = fmax(error, (double)fabsl(hyst_modified_play_forward(&model, &state, drive) - y * 0x1p31L));
        }
        if (peak < 0.99L) { /* long double does not saturate */
            TEST_ASSERT_TRUE(error <= bound);
            worst = fmax(worst, error / bound);
        }
    }
    printf("2000 samples on its own: at most %.2f of the error that rounding explains\n", worst);
    TEST_ASSERT_TRUE(worst > 0.0);
}

static hyst_q28_t steepest_of(const hyst_modified_play_t *model) {
    hyst_q28_t steepest = 0;
    for (uint32_t down = 0; down < 2U; down++) {
        for (uint32_t zone = 0; zone <= model->parameters.divisions; zone++) {
            for (uint32_t row = 0; row < model->parameters.divisions && row <= zone + 1U; row++) {
                const hyst_q28_t slope = model->branch[down][HYST_MODIFIED_PLAY_ZONE(zone) + row];
                steepest = slope > steepest ? slope : steepest;
            }
        }
    }
    return steepest;
}

static void test_composition(void) {
    composition_count_t total = {0, 0, 0};
    while (total.composed < composition_samples()) {
        hyst_modified_play_t model;
        (void)modified_play_random(&rng, &model);
        /* Rounding the drive costs half the steepest slope, rounding the output 1/2; the error is an integer. */
        const int64_t bound = (int64_t)floor(0.5 * steepest_of(&model) / HYST_Q28_ONE + 0.5);
        hyst_modified_play_state_t inverse, forward;
        hyst_modified_play_reset(&model, &inverse, 0);
        hyst_modified_play_reset(&model, &forward, 0);
        walk_t walk = {.kind = REST, .ramp = 1};
        for (int k = 0; k < 20000; k++) {
            change_sometimes(&walk);
            hyst_modified_play_state_t probe = inverse;
            hyst_q31_t wanted =
                hyst_modified_play_forward(&model, &probe, next_drive(&model, &inverse, walk.kind, walk.ramp));
            if (random_unit(&rng) < 0.1) {
                wanted = random_unit(&rng) < 0.3 ? random_q31(&rng) : hyst_add(wanted, random_between(&rng, -3, 3));
            }
            bool saturated = false;
            const hyst_q31_t drive = hyst_modified_play_inverse(&model, &inverse, wanted, &saturated);
            const hyst_q31_t got = hyst_modified_play_forward(&model, &forward, drive);
            composition_add(&total, wanted, drive, saturated, got, bound);
        }
    }
    composition_report(&total);
}

/* Inner rows stay within one pitch of the next outer ones, whatever the rates: what the walk over the corners needs. */
static void test_plays_stay_nested(void) {
    for (int run = 0; run < 200; run++) {
        hyst_modified_play_t model, other;
        (void)modified_play_random(&rng, &model);
        (void)modified_play_random(&rng, &other);
        hyst_modified_play_state_t state, carried;
        hyst_modified_play_reset(&model, &state, random_q31(&rng));
        walk_t walk = {.kind = JUMP, .ramp = 1};
        for (int k = 0; k < 500; k++) {
            change_sometimes(&walk);
            hyst_modified_play_advance(&model, &state, next_drive(&model, &state, walk.kind, walk.ramp));
            for (uint32_t row = 1; row + 1U < model.parameters.divisions; row++) {
                TEST_ASSERT_TRUE(llabs((int64_t)state.play[row] - state.play[row - 1U]) <= model.pitch);
            }
        }
        hyst_modified_play_carry(&model, &state, &other, &carried);
        TEST_ASSERT_EQUAL_INT32(state.drive, carried.drive);
        TEST_ASSERT_EQUAL_INT32(state.position[0], carried.position[0]);
        for (uint32_t row = 1; row + 1U < other.parameters.divisions; row++) {
            TEST_ASSERT_TRUE(llabs((int64_t)carried.play[row] - carried.play[row - 1U]) <= other.pitch);
        }
        hyst_modified_play_carry(&model, &state, &model, &carried);
        for (uint32_t row = 0; row + 1U < model.parameters.divisions; row++) {
            TEST_ASSERT_EQUAL_INT32(state.play[row], carried.play[row]);
        }
    }
}

/* Reading plays off another grid loses little where the memory is straight: a slow rise from the demagnetised state. */
static void test_carry_between_grids(void) {
    hyst_modified_play_parameters_t p = modified_play_plain(0.3, 0.05);
    const hyst_modified_play_t ten = modified_play_accept(&p);
    p.divisions = 5;
    const hyst_modified_play_t five = modified_play_accept(&p);
    hyst_modified_play_state_t state, carried, back;
    hyst_modified_play_reset(&ten, &state, INT32_MAX / 2);
    hyst_modified_play_carry(&ten, &state, &five, &carried);
    for (uint32_t row = 0; row < 4U; row++) {
        TEST_ASSERT_INT32_WITHIN(8, state.play[2U * row + 1U], carried.play[row]);
    }
    hyst_modified_play_carry(&five, &carried, &ten, &back);
    for (uint32_t row = 0; row < 9U; row++) {
        /* Row 5 of 10 stands at the kink of the memory, which the coarser grid has missed by half its pitch at most. */
        TEST_ASSERT_INT32_WITHIN(ten.pitch / 2 + 8, state.play[row], back.play[row]);
    }
}

/* Locked to a phase later on or started with it: the same next sample. */
static void test_set_phase(void) {
    for (int run = 0; run < 100; run++) {
        hyst_modified_play_t model;
        hyst_modified_play_parameters_t p = modified_play_random(&rng, &model);
        p.phase = (uint32_t)random_bits(&rng);
        const hyst_modified_play_t locked = modified_play_accept(&p);
        hyst_modified_play_state_t set, started;
        const hyst_q31_t start = random_q31(&rng);
        const hyst_q31_t drive = random_q31(&rng);
        hyst_modified_play_reset(&model, &set, start);
        hyst_modified_play_set_phase(&model, &set, p.phase);
        hyst_modified_play_reset(&locked, &started, start);
        TEST_ASSERT_EQUAL_INT32(hyst_modified_play_forward(&locked, &started, drive),
                                hyst_modified_play_forward(&model, &set, drive));
        TEST_ASSERT_EQUAL_UINT32(started.phase, set.phase);
    }
}

/* What reset promises: held at that drive, a model without harmonics stays. */
static void test_reset_is_rest(void) {
    for (int run = 0; run < 200; run++) {
        hyst_modified_play_t model;
        hyst_modified_play_parameters_t p = modified_play_random(&rng, &model);
        memset(p.sine, 0, sizeof p.sine);
        memset(p.cosine, 0, sizeof p.cosine);
        model = modified_play_accept(&p);
        hyst_modified_play_state_t state;
        const hyst_q31_t drive = random_q31(&rng);
        hyst_modified_play_reset(&model, &state, drive);
        const hyst_q31_t at_rest = hyst_modified_play_output(&model, &state);
        if (at_rest == INT32_MIN || at_rest == INT32_MAX) {
            continue;
        }
        /* Half a unit too much in all past y is half a unit times (1 - c1 - c2 - c3 - g u) per sample into the filter,
         * and g u is known to half a unit of 2^-28, which is 4 units of y. In a sample y u is rounded before g takes
         * it, and so is y, as a difference. */
        const response_t response = response_of(&p, drive * 0x1p-31);
        const double bracket =
            1.0 - ((double)p.feedback[0] + p.feedback[1] + p.feedback[2] + drive * 0x1p-31 * p.bilinear) * 0x1p-28;
        const double bound =
            1.0 + (0.5 * bracket + 4.0 + 0.5 * fabs(p.bilinear * 0x1p-28)) * response.gain + 0.5 * response.change;
        for (int k = 0; k < 200; k++) {
            const double moved = (double)hyst_modified_play_forward(&model, &state, drive) - at_rest;
            TEST_ASSERT_TRUE(fabs(moved) <= bound);
        }
    }
}

/* The source's compensator misses by what H changes within the sample, exactly that: modified_play.h. */
static void test_direct_inverse_misses_by_the_change_of_the_plays(void) {
    double worst_exact = 0.0;
    double worst_direct = 0.0;
    const hyst_modified_play_parameters_t p = modified_play_plain(0.4, 0.04); /* S up to 0.4 + 5 * 0.04 */
    const hyst_modified_play_t model = modified_play_accept(&p);
    hyst_modified_play_state_t exact, direct;
    hyst_modified_play_reset(&model, &exact, 0);
    hyst_modified_play_reset(&model, &direct, 0);
    reference_play_t reference = reference_play(&p);
    for (int k = 1; k < 5000; k++) {
        const hyst_q31_t wanted = (hyst_q31_t)lround(0.45 * 0x1p31 * sin(k * 0.01));
        bool saturated = false;
        (void)hyst_modified_play_inverse(&model, &exact, wanted, &saturated);
        worst_exact = fmax(worst_exact, fabs((double)hyst_modified_play_output(&model, &exact) - wanted));
        reference_play_copy(&reference, &direct);
        const long double before = reference_play_share(&reference);
        const hyst_q31_t drive = hyst_modified_play_direct_inverse(&model, &direct, wanted, &saturated);
        const double error = (double)hyst_modified_play_forward(&model, &direct, drive) - wanted;
        reference_play_copy(&reference, &direct);
        const double change = (double)((reference_play_share(&reference) - before) * 0x1p31L);
        TEST_ASSERT_DOUBLE_WITHIN(2.0, change, error);
        TEST_ASSERT_FALSE(saturated);
        worst_direct = fmax(worst_direct, fabs(error));
    }
    printf(
        "sine of 628 samples: exact inverse off by %.0f * 2^-31, direct inverse multiplication by %.1e of full scale\n",
        worst_exact, worst_direct * 0x1p-31);
    TEST_ASSERT_TRUE(worst_exact <= 1.0);
    TEST_ASSERT_TRUE(worst_direct > 1e-4 * 0x1p31);
}

/* .. and chatters where the plays' share of the slope exceeds 2A; the exact inverse does not. */
static void test_direct_inverse_chatters_where_plays_outweigh_2a(void) {
    const hyst_modified_play_parameters_t p = modified_play_plain(0.1, 0.06); /* S - 2A up to 0.3 */
    const hyst_modified_play_t model = modified_play_accept(&p);
    double worst[2] = {0.0, 0.0};
    int reversals[2] = {0, 0};
    for (int kind = 0; kind < 2; kind++) {
        hyst_modified_play_state_t state;
        hyst_modified_play_reset(&model, &state, 0);
        int64_t step = 0;
        for (int k = 1; k < 6283; k++) { /* ten periods: 20 reversals are due */
            const hyst_q31_t wanted = (hyst_q31_t)lround(0.2 * 0x1p31 * sin(k * 0.01));
            bool saturated = false;
            const hyst_q31_t drive = (kind == 0 ? hyst_modified_play_solve : hyst_modified_play_direct_inverse)(
                &model, &state, wanted, &saturated);
            reversals[kind] += ((int64_t)drive - state.drive < 0) != (step < 0) ? 1 : 0;
            step = (int64_t)drive - state.drive;
            worst[kind] =
                fmax(worst[kind], fabs((double)hyst_modified_play_forward(&model, &state, drive) - wanted) * 0x1p-31);
        }
    }
    printf("plays three times 2A: exact inverse off by %.1e with %d reversals, direct inverse multiplication by %.1e "
           "with %d\n",
           worst[0], reversals[0], worst[1], reversals[1]);
    TEST_ASSERT_TRUE(worst[0] < 1e-9);
    TEST_ASSERT_EQUAL_INT(20, reversals[0]);
    TEST_ASSERT_TRUE(worst[1] > 1e-3);
    TEST_ASSERT_TRUE(reversals[1] > 1000);
}

/* The largest that the validator accepts, driven from end to end: the sanitizers look for overflow. */
static void test_extremes(void) {
    static const hyst_q31_t ends[] = {INT32_MIN, INT32_MAX, 0};
    for (uint32_t divisions = 1; divisions <= HYST_MODIFIED_PLAY_MAX_DIVISIONS; divisions += 5) {
        for (int sign = -1; sign <= 1; sign += 2) {
            hyst_modified_play_parameters_t p = {.divisions = divisions,
                                                 .offset = sign < 0 ? INT32_MIN : INT32_MAX,
                                                 .direct = 2 * HYST_Q28_ONE,
                                                 .rate_gain = HYST_Q30_ONE / 1024,
                                                 .alpha = INT32_MAX,
                                                 .beta = INT32_MAX,
                                                 .bilinear = sign * (HYST_Q28_ONE / 2048),
                                                 .feedback = {724775731, -652298158, 195689447}};
            for (uint32_t cell = 0; cell < HYST_MODIFIED_PLAY_CELLS(divisions); cell++) {
                p.slope[cell] = sign * (HYST_Q28_ONE / 256);
            }
            for (int i = 0; i < HYST_MODIFIED_PLAY_HARMONICS; i++) {
                p.sine[i] = sign * (HYST_Q28_ONE / 16);
                p.cosine[i] = -sign * (HYST_Q28_ONE / 16);
            }
            const hyst_modified_play_t model = modified_play_accept(&p);
            hyst_modified_play_state_t state;
            hyst_modified_play_reset(&model, &state, ends[0]);
            for (int k = 0; k < 3000; k++) {
                const hyst_q31_t drive = k % 4 == 3 ? random_q31(&rng) : ends[k % 3];
                bool saturated = false;
                (void)hyst_modified_play_solve(&model, &state, ends[k % 2], &saturated);
                (void)hyst_modified_play_direct_inverse(&model, &state, ends[k / 2 % 2], &saturated);
                (void)hyst_modified_play_forward(&model, &state, drive);
                TEST_ASSERT_TRUE(abs(state.remainder) <= 1 << 27);
            }
        }
    }
}

int main(void) {
    rng = random_start("test_modified_play", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_each_sample_equals_long_double);
    RUN_TEST(test_free_run_follows_long_double);
    RUN_TEST(test_composition);
    RUN_TEST(test_plays_stay_nested);
    RUN_TEST(test_carry_between_grids);
    RUN_TEST(test_set_phase);
    RUN_TEST(test_reset_is_rest);
    RUN_TEST(test_direct_inverse_misses_by_the_change_of_the_plays);
    RUN_TEST(test_direct_inverse_chatters_where_plays_outweigh_2a);
    RUN_TEST(test_extremes);
    return UNITY_END();
}
