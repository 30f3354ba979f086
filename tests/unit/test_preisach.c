/* SPDX-License-Identifier: MIT */
/* Preisach model: against the plain sums of its definition, relays and play operators; its properties; its validator.
 */
#include "models.h"
#include "preisach_models.h"
#include "unity.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

static uint32_t any_grid(void) {
    return 1U + (uint32_t)(random_bits(&rng) % HYST_PREISACH_MAX_INTERVALS);
}

static hyst_preisach_t any_model(void) {
    const preisach_arguments_t a = preisach_random(&rng, any_grid());
    return preisach_accept(&a);
}

/* A drive anywhere, or near the present one, or an end, or on a level. */
static hyst_q31_t any_drive(const hyst_preisach_state_t *state, uint32_t intervals) {
    const double kind = random_unit(&rng);
    if (kind < 0.05) {
        return random_unit(&rng) < 0.5 ? INT32_MIN : INT32_MAX;
    }
    if (kind < 0.15) {
        const int64_t i = (int64_t)(random_bits(&rng) % (intervals + 1U));
        return hyst_saturate(INT32_MIN + i * ((int64_t)1 << 32) / intervals);
    }
    return hyst_add(state->now.drive, random_q31(&rng) >> (random_bits(&rng) % 12U));
}

static void wander(const hyst_preisach_t *model, hyst_preisach_state_t *state, int samples) {
    for (int k = 0; k < samples; k++) {
        hyst_preisach_advance(model, state, any_drive(state, model->intervals));
    }
}

static void at_lower_end(const hyst_preisach_t *model, hyst_preisach_state_t *state) {
    hyst_preisach_reset(model, state, INT32_MIN);
    TEST_ASSERT_EQUAL_UINT32(1, state->extremes);
}

/* Against the sums of (2.18) and (2.22), without rounding: the output is the nearest integer, or one of two next to a
 * tie (long double keeps 64 bits, and floors at 2^-60 add up over at most 64 reversals). */
static void test_equals_the_sums_of_its_definition(void) {
    static preisach_reference_t reference;
    double worst = 0.0;
    for (int run = 0; run < 200; run++) {
        const preisach_arguments_t a = preisach_random(&rng, any_grid());
        const hyst_preisach_t model = preisach_accept(&a);
        preisach_reference_begin(&reference, &a);
        hyst_preisach_state_t state;
        at_lower_end(&model, &state);
        for (int k = 0; k < 2000; k++) {
            const hyst_q31_t drive = any_drive(&state, model.intervals);
            hyst_preisach_advance(&model, &state, drive);
            const long double expected = preisach_reference_forward(&reference, drive * 0x1p-31L);
            worst = fmax(worst, (double)fabsl(state.now.output * 0x1p-60L - expected) * 0x1p31);
            const double rounded = hyst_preisach_output(&model, &state);
            const long double clipped = fminl(fmaxl(expected * 0x1p31L, INT32_MIN), INT32_MAX);
            TEST_ASSERT_TRUE(fabsl((long double)rounded - clipped) <= 0.5L + 0x1p-20L);
        }
    }
    printf("worst difference from the sums: %.3g units of 2^-31\n", worst);
    TEST_ASSERT_TRUE(worst < 0x1p-20);
}

/*
 * At levels the model is a sum of relays: one of weight E(i,j+1) + E(i-1,j) - ... for each square, one for each
 * triangle. Explicit relays, integers, equality.
 */
static void test_equals_explicit_relays_at_the_levels(void) {
    enum { N = 16 };
    for (int run = 0; run < 50; run++) {
        const preisach_arguments_t a = preisach_random(&rng, N);
        const hyst_preisach_t model = preisach_accept(&a);
        int64_t e[N + 1][N + 1] = {{0}};
        for (int i = 1; i <= N; i++) {
            for (int j = 0; j < i; j++) {
                e[i][j] = a.everett[i * (i - 1) / 2 + j];
            }
        }
        bool up[N + 1][N + 1] = {{false}}; /* relay between levels (i-1, i) upwards and (j, j+1) downwards */
        hyst_preisach_state_t state;
        at_lower_end(&model, &state);
        for (int k = 0; k < 500; k++) {
            const int level = (int)(random_bits(&rng) % N); /* the top level is not a Q31 */
            int64_t sum = 0;
            for (int i = 1; i <= N; i++) {
                for (int j = 0; j < i; j++) {
                    if (level >= i) {
                        up[i][j] = true;
                    } else if (level <= j) {
                        up[i][j] = false;
                    }
                    const int64_t weight = i == j + 1 ? e[i][j] : e[i][j] - e[i - 1][j] - e[i][j + 1] + e[i - 1][j + 1];
                    sum += up[i][j] ? weight : 0;
                }
            }
            hyst_preisach_advance(&model, &state, (hyst_q31_t)(INT32_MIN + ((int64_t)level << 28)));
            const int64_t lowest = a.offset * ((int64_t)1 << 29) - e[N][0] * ((int64_t)1 << 31);
            TEST_ASSERT_EQUAL_INT64(lowest + sum * ((int64_t)1 << 32), state.now.output);
        }
    }
}

/*
 * A Prandtl-Ishlinskii model has E(a, b) = 2 F((a - b) / 2), F its initial curve. Thresholds at multiples of half an
 * interval put the corners on levels, and with reversals on levels both are exact: equality to the bit on the whole way
 * between reversals.
 */
static void test_contains_prandtl_ishlinskii(void) {
    enum { N = 16 };
    for (int run = 0; run < 50; run++) {
        hyst_q28_t weight[N] = {HYST_Q28_ONE / 4};
        hyst_q31_t threshold[N - 1];
        for (int m = 1; m < N; m++) {
            weight[m] = random_between(&rng, -HYST_Q28_ONE / 256, HYST_Q28_ONE / 8) / 8 * 8;
            threshold[m - 1] = m * (INT32_MAX / N + 1);
        }
        preisach_arguments_t a = {.intervals = N, .offset = random_q31(&rng) / 4};
        for (int i = 1; i <= N; i++) {
            for (int j = 0; j < i; j++) {
                int64_t sum = 0;
                for (int m = 0; m < i - j; m++) {
                    sum += (int64_t)weight[m] * (i - j - m); /* 2 w (d/2 - a), in intervals of 2 / N */
                }
                a.everett[i * (i - 1) / 2 + j] = (hyst_q28_t)(sum / (N / 2));
            }
        }
        const hyst_preisach_t model = preisach_accept(&a);
        static hyst_pi_t pi;
        uint32_t element = 0;
        TEST_ASSERT_EQUAL_INT(HYST_PI_OK, hyst_pi_build(&pi, N - 1, a.offset, weight, threshold, 0, 0, &element));
        hyst_preisach_state_t state;
        static hyst_pi_state_t play;
        hyst_preisach_reset(&model, &state, INT32_MIN);
        hyst_pi_reset(&pi, &play, INT32_MIN);
        int64_t from = INT32_MIN;
        for (int k = 0; k < 200; k++) {
            const int64_t to = INT32_MIN + (int64_t)(random_bits(&rng) % N) * ((int64_t)1 << 28);
            for (int part = 1; part <= 5; part++) {
                const int64_t between = part == 5 ? to : from + (to - from) * part / 5;
                const hyst_q31_t drive = (hyst_q31_t)between;
                TEST_ASSERT_EQUAL_INT32(hyst_pi_forward(&pi, &play, drive),
                                        hyst_preisach_forward(&model, &state, drive));
            }
            from = to;
        }
    }
}

/* An excursion that stays inside the present loop, and back to where it began or beyond the last reversal, leaves no
 * trace: state and output to the last bit. */
static void test_wiping_out(void) {
    for (int run = 0; run < 3000; run++) {
        const hyst_preisach_t model = any_model();
        hyst_preisach_state_t direct;
        at_lower_end(&model, &direct);
        wander(&model, &direct, (int)(random_bits(&rng) % 40U));
        hyst_preisach_state_t detour = direct;
        const hyst_q31_t here = direct.now.drive;
        const hyst_q31_t last = direct.extreme[direct.extremes - 1U].drive;
        if (direct.extremes + 12U > HYST_PREISACH_MAX_EXTREMES || here == last) {
            continue;
        }
        for (int k = 0; k < 12; k++) { /* between the last reversal and here */
            hyst_preisach_advance(&model, &detour,
                                  here < last ? random_between(&rng, here, last) : random_between(&rng, last, here));
        }
        const hyst_q31_t beyond =
            here > last ? random_between(&rng, here, INT32_MAX) : random_between(&rng, INT32_MIN, here);
        hyst_preisach_advance(&model, &direct, beyond);
        hyst_preisach_advance(&model, &detour, beyond);
        TEST_ASSERT_EQUAL_UINT32(direct.extremes, detour.extremes);
        TEST_ASSERT_EQUAL_INT64(direct.now.output, detour.now.output);
        for (uint32_t k = 0; k < direct.extremes; k++) {
            TEST_ASSERT_EQUAL_INT32(direct.extreme[k].drive, detour.extreme[k].drive);
            TEST_ASSERT_EQUAL_INT64(direct.extreme[k].output, detour.extreme[k].output);
        }
    }
}

/* The same two drives after different pasts give the same loop, shifted; and it closes: to the last bit. */
static void test_congruent_minor_loops_that_close(void) {
    for (int run = 0; run < 1000; run++) {
        const hyst_preisach_t model = any_model();
        const hyst_q31_t low = random_between(&rng, INT32_MIN, INT32_MAX - 1);
        const hyst_q31_t high = random_between(&rng, low + 1, INT32_MAX);
        int64_t width[2][4];
        for (int past = 0; past < 2; past++) {
            hyst_preisach_state_t state;
            at_lower_end(&model, &state);
            wander(&model, &state, (int)(random_bits(&rng) % 30U));
            hyst_preisach_advance(&model, &state, low);
            hyst_preisach_advance(&model, &state, high);
            hyst_preisach_advance(&model, &state, low);
            const int64_t at_low = state.now.output;
            for (int k = 0; k < 4; k++) {
                const int64_t part = low + ((int64_t)high - low) * (k + 1) / 4;
                hyst_preisach_advance(&model, &state, (hyst_q31_t)part);
                width[past][k] = state.now.output - at_low;
            }
            hyst_preisach_advance(&model, &state, low);
            TEST_ASSERT_EQUAL_INT64(at_low, state.now.output);
        }
        for (int k = 0; k < 4; k++) {
            TEST_ASSERT_EQUAL_INT64(width[0][k], width[1][k]);
        }
    }
}

/* More drive, more position: from any state, whichever branch or older branch it ends on. */
static void test_output_rises_with_the_drive(void) {
    for (int run = 0; run < 500; run++) {
        const hyst_preisach_t model = any_model();
        const double flattest = preisach_slopes(&model).flattest;
        hyst_preisach_state_t state;
        at_lower_end(&model, &state);
        wander(&model, &state, (int)(random_bits(&rng) % 60U));
        for (int k = 0; k < 50; k++) {
            hyst_preisach_state_t low = state;
            hyst_preisach_state_t high = state;
            hyst_q31_t a = random_q31(&rng);
            hyst_q31_t b = random_unit(&rng) < 0.5 ? random_q31(&rng) : hyst_add(a, 1);
            hyst_preisach_advance(&model, &low, a < b ? a : b);
            hyst_preisach_advance(&model, &high, a < b ? b : a);
            const double least = flattest * fabs((double)b - a); /* units of 2^-31 */
            if (state.extremes < HYST_PREISACH_MAX_EXTREMES) {   /* else one of the two may have been merged */
                TEST_ASSERT_TRUE((double)(high.now.output - low.now.output) * 0x1p-29 >=
                                 least * (1.0 - 1e-12) - 0x1p-26);
            }
        }
    }
}

/* Reversals that come ever closer, many more than the stack holds: what merging costs, and that it heals. */
static void test_merging_when_the_stack_is_full(void) {
    static preisach_reference_t reference;
    double worst_of_bound = 0.0;
    for (int run = 0; run < 100; run++) {
        const preisach_arguments_t a = run % 2 == 0 ? preisach_smooth(30, 0.5, 0.2) : preisach_random(&rng, any_grid());
        const hyst_preisach_t model = preisach_accept(&a);
        const slopes_t slopes = preisach_slopes(&model);
        const double bound = 0x1p32 / 63.0 * (slopes.steepest - slopes.flattest) + 0x1p-20;
        preisach_reference_begin(&reference, &a);
        hyst_preisach_state_t state;
        at_lower_end(&model, &state);
        double merged_before = 0.0; /* what earlier merges moved the output by */
        double drive = 0x1.fffffep30;
        for (int k = 0; k < 400; k++) {
            const hyst_q31_t to = (hyst_q31_t)lround(drive);
            const bool full = state.extremes == HYST_PREISACH_MAX_EXTREMES;
            hyst_preisach_advance(&model, &state, to);
            const double expected = (double)(preisach_reference_forward(&reference, to * 0x1p-31L) * 0x1p31L);
            const double moved = (double)state.now.output * 0x1p-29 - expected;
            TEST_ASSERT_TRUE(state.extremes <= HYST_PREISACH_MAX_EXTREMES);
            if (full && state.extremes == HYST_PREISACH_MAX_EXTREMES - 1U) {
                worst_of_bound = fmax(worst_of_bound, fabs(moved - merged_before) / bound);
                TEST_ASSERT_TRUE_MESSAGE(fabs(moved - merged_before) <= bound, "a merge moved the output too far");
            } else {
                TEST_ASSERT_DOUBLE_WITHIN(0x1p-10, merged_before, moved); /* double: 2^31 units with 53 bits */
            }
            merged_before = moved;
            drive *= -(0.97 + 0.02 * random_unit(&rng));
        }
        for (int end = 0; end < 2; end++) { /* a sweep over the range erases what was merged */
            const hyst_q31_t to = end == 0 ? INT32_MAX : INT32_MIN;
            hyst_preisach_advance(&model, &state, to);
            const double expected = (double)(preisach_reference_forward(&reference, to * 0x1p-31L) * 0x1p31L);
            TEST_ASSERT_DOUBLE_WITHIN(0x1p-10, expected, (double)state.now.output * 0x1p-29);
        }
    }
    printf("worst merge: %.3g of its bound\n", worst_of_bound);
    TEST_ASSERT_TRUE(worst_of_bound > 0.0); /* it did happen */
}

/* Reset: demagnetised, so between the two branches of the full loop, near the middle of them for a symmetric table. */
static void test_reset_is_demagnetised(void) {
    const preisach_arguments_t a = preisach_smooth(30, 0.4, 0.1);
    const hyst_preisach_t model = preisach_accept(&a);
    for (int k = 0; k < 200; k++) {
        const hyst_q31_t drive = random_q31(&rng);
        hyst_preisach_state_t state, direct;
        hyst_preisach_reset(&model, &state, drive);
        hyst_preisach_reset(&model, &direct, 0);
        hyst_preisach_advance(&model, &direct, drive);
        TEST_ASSERT_EQUAL_INT64(direct.now.output, state.now.output); /* a slow move from anywhere inside */
        hyst_preisach_state_t rising, falling;
        at_lower_end(&model, &rising);
        hyst_preisach_advance(&model, &rising, drive);
        at_lower_end(&model, &falling);
        hyst_preisach_advance(&model, &falling, INT32_MAX);
        hyst_preisach_advance(&model, &falling, drive);
        TEST_ASSERT_TRUE(rising.now.output <= state.now.output && state.now.output <= falling.now.output);
    }
    hyst_preisach_state_t state;
    hyst_preisach_reset(&model, &state, 0);
    /*
     * The relays have the density 2 * curve, and the staircase of 15 steps of one interval h encloses 15 triangles of
     * h^2 / 2 more than the diagonal of a demagnetisation in infinitely many steps would. The even part, 0.02 u^2, is 0
     * at 0 and 0.02 in the offset. The table's rounding, 60 elements of 2^-29, is below 2e-7.
     */
    const double h = 2.0 / 30.0;
    TEST_ASSERT_DOUBLE_WITHIN(2e-7, 0.1 * 15.0 * h * h - 0.02, (double)state.now.output * 0x1p-60);
}

static void test_carry(void) {
    for (int run = 0; run < 300; run++) {
        const hyst_preisach_t from = any_model();
        const hyst_preisach_t to = any_model();
        hyst_preisach_state_t state, same, carried, followed;
        at_lower_end(&from, &state);
        at_lower_end(&to, &followed);
        for (int k = 0; k < 40; k++) { /* too few to fill the stack: merging would depend on the table */
            const hyst_q31_t drive = any_drive(&state, from.intervals);
            hyst_preisach_advance(&from, &state, drive);
            hyst_preisach_advance(&to, &followed, drive);
        }
        preisach_carry(&from, &state, &from, &same);
        TEST_ASSERT_EQUAL_INT64(state.now.output, same.now.output);
        TEST_ASSERT_EQUAL_UINT32(state.extremes, same.extremes);
        preisach_carry(&from, &state, &to, &carried);
        TEST_ASSERT_EQUAL_INT64(followed.now.output, carried.now.output);
        TEST_ASSERT_EQUAL_UINT32(followed.extremes, carried.extremes);
        for (uint32_t k = 0; k < carried.extremes; k++) {
            TEST_ASSERT_EQUAL_INT32(followed.extreme[k].drive, carried.extreme[k].drive);
            TEST_ASSERT_EQUAL_INT64(followed.extreme[k].output, carried.extreme[k].output);
        }
    }
}

/* The steepest and the flattest table there is, offsets at both ends: nothing wraps. */
static void test_extremes_of_the_format(void) {
    static preisach_reference_t reference;
    for (uint32_t n = 1; n <= HYST_PREISACH_MAX_INTERVALS; n++) {
        for (int corner = 0; corner < 4; corner++) {
            preisach_arguments_t a = {.intervals = n, .offset = corner % 2 == 0 ? INT32_MIN : INT32_MAX};
            for (uint32_t i = 1; i <= n; i++) {
                for (uint32_t j = 0; j < i; j++) {
                    const int64_t step = corner < 2 ? preisach_largest_step(n) : preisach_least_step(n);
                    const int64_t value = step * (i - j);
                    a.everett[i * (i - 1U) / 2U + j] = value > INT32_MAX ? INT32_MAX : (hyst_q28_t)value;
                }
            }
            const hyst_preisach_t model = preisach_accept(&a);
            preisach_reference_begin(&reference, &a);
            hyst_preisach_state_t state;
            at_lower_end(&model, &state);
            for (int k = 0; k < 100; k++) {
                const hyst_q31_t drive = any_drive(&state, n);
                hyst_preisach_advance(&model, &state, drive);
                const long double expected = preisach_reference_forward(&reference, drive * 0x1p-31L);
                TEST_ASSERT_TRUE(fabsl(state.now.output * 0x1p-60L - expected) < 0x1p-55L);
            }
        }
    }
}

int main(void) {
    rng = random_start("test_preisach", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_equals_the_sums_of_its_definition);
    RUN_TEST(test_equals_explicit_relays_at_the_levels);
    RUN_TEST(test_contains_prandtl_ishlinskii);
    RUN_TEST(test_wiping_out);
    RUN_TEST(test_congruent_minor_loops_that_close);
    RUN_TEST(test_output_rises_with_the_drive);
    RUN_TEST(test_merging_when_the_stack_is_full);
    RUN_TEST(test_reset_is_demagnetised);
    RUN_TEST(test_carry);
    RUN_TEST(test_extremes_of_the_format);
    return UNITY_END();
}
