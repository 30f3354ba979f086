/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The Bouc-Wen curve against its closed form, whatever the sampling, and as cells in the amplifier's library. */
#include "chain/catalogue.h"
#include "chain/chain.h"
#include "compile/compile.h"
#include "compile/compile_bouc_wen.h"
#include "hyst/bouc_wen.h"
#include "random.h"
#include "unity.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static random_t rng;

void setUp(void) {
}
void tearDown(void) {
}

/* n = 1 has exponentials: h of a rising drive at the travelled drive v, h = 0 at v = 0. */
static double exponential(double beta, double gamma, double v) {
    const double rate = v > 0.0 ? -(beta + gamma) : gamma - beta;
    return fabs(rate) < 1e-12 ? v : expm1(rate * v) / rate;
}

static double place(double beta, double gamma, double h) {
    const double rate = h > 0.0 ? -(beta + gamma) : gamma - beta;
    return fabs(rate) < 1e-12 ? h : log1p(rate * h) / rate;
}

/* n = 1, samples anywhere in [-1, 1]. The curve is a cubic in each cell of 1/512 of the limit. There its distance to
 * the limit falls by a factor of 2/3 at most: (ln 1.5)^4 / 384 of 2.5/512. */
static void test_exponent_1_is_exponentials(void) {
    double worst = 0.0;
    for (int run = 0; run < 100; run++) {
        const double beta = 0.1 + 5.0 * random_unit(&rng);
        const double gamma = beta * (2.0 * random_unit(&rng) - 0.999);
        const double limit = 1.0 / (beta + gamma);
        bouc_wen_t model;
        bouc_wen_open(&model, beta, gamma, 1.0);
        double drive = 0.0, h = 0.0;
        for (int k = 0; k < 200; k++) {
            const double u = 2.0 * random_unit(&rng) - 1.0, sign = u < drive ? -1.0 : 1.0;
            const double before = fmin(sign * h, (1.0 - 1e-12) * limit);
            h = sign * exponential(beta, gamma, place(beta, gamma, before) + fabs(u - drive));
            drive = u;
            worst = fmax(worst, fabs(bouc_wen_step(&model, u) - h) / limit);
        }
    }
    printf("against exponentials: within %.1e of the limit\n", worst);
    TEST_ASSERT_TRUE(worst < 1e-6);
}

/* Any exponent: one long step is a thousand short ones. */
static void test_sampling_does_not_matter(void) {
    double worst = 0.0;
    for (int run = 0; run < 50; run++) {
        const double beta = 0.1 + 5.0 * random_unit(&rng);
        bouc_wen_t one, many;
        bouc_wen_open(&one, beta, beta * (2.0 * random_unit(&rng) - 0.999), 1.0 + 4.0 * random_unit(&rng));
        many = one;
        double from = 0.0;
        for (int k = 0; k < 20; k++) {
            const double u = 2.0 * random_unit(&rng) - 1.0;
            double h = 0.0;
            for (int i = 1; i <= 1000; i++) {
                h = bouc_wen_step(&many, from + (u - from) * i / 1000.0);
            }
            from = u;
            worst = fmax(worst, fabs(bouc_wen_step(&one, u) - h) / pow(one.beta + one.gamma, -1.0 / one.exponent));
        }
    }
    printf("one step and a thousand: within %.1e of the limit\n", worst);
    TEST_ASSERT_TRUE(worst < 1e-10); /* one curve: but for rounding */
}

/* The same equation by Runge and Kutta, in steps so short that they do not matter, however steep it is. */
static double by_short_steps(const bouc_wen_t *of, double h, double way) {
    double left = fabs(way);
    while (left > 0.0) {
        const double bend = of->exponent * 2.0 * of->beta * pow(fabs(h), of->exponent - 1.0);
        const double size = fmin(left, fmin(fabs(way) / 256.0, 0.02 / bend)), d = copysign(size, way);
        double slope[4], at = h;
        for (int s = 0; s < 4; s++) {
            const double sign = way * at > 0.0 ? 1.0 : -1.0;
            slope[s] = 1.0 - (of->gamma + of->beta * sign) * pow(fabs(at), of->exponent);
            at = h + (s < 2 ? 0.5 : 1.0) * d * slope[s];
        }
        h += d / 6.0 * (slope[0] + 2.0 * (slope[1] + slope[2]) + slope[3]);
        left -= size;
    }
    return h;
}

/* Sampled as recordings are: slow and fast drives that turn anywhere. Also where |h| has no limit, and where the drive
 * goes ten times as far as the curve at first. Off as above, and by
 * what the short step across the kink at h = 0 makes: some (0.3 / 256)^2 beta. */
static void test_the_curve_is_the_equation(void) {
    static const struct { double least_exponent, most_exponent; } kinds[] = {{1.0, 2.0}, {2.0, 6.0}, {6.0, 20.0}};
    for (size_t kind = 0; kind < sizeof kinds / sizeof kinds[0]; kind++) {
        double worst = 0.0;
        for (int run = 0; run < 40; run++) {
            const double span = kinds[kind].most_exponent - kinds[kind].least_exponent;
            const double beta = pow(10.0, 2.0 * random_unit(&rng) - 1.0);
            const double gamma = beta * fmax(-1.0, 2.1 * random_unit(&rng) - 1.1);
            const double range = random_unit(&rng) < 0.2 ? 10.0 : 1.0;
            bouc_wen_t model;
            bouc_wen_open(&model, beta, gamma, kinds[kind].least_exponent + span * random_unit(&rng));
            const double step = pow(10.0, -3.0 * random_unit(&rng) - 0.5);
            double u = 0.0, h = 0.0, direction = 1.0, largest = 0.0, off = 0.0;
            for (int k = 0; k < 1000; k++) {
                direction = fabs(u) > range            ? (u > 0.0 ? -1.0 : 1.0)
                            : random_unit(&rng) < step ? -direction
                                                       : direction;
                const double way = direction * step * random_unit(&rng);
                h = by_short_steps(&model, h, way);
                u += way;
                off = fmax(off, fabs(bouc_wen_step(&model, u) - h));
                largest = fmax(largest, fabs(h));
            }
            worst = fmax(worst, off / largest);
        }
        printf("exponents %.0f to %.0f: within %.1e of the largest h\n", kinds[kind].least_exponent,
               kinds[kind].most_exponent, worst);
        TEST_ASSERT_TRUE(worst < 5e-6);
    }
}

static double through_the_amplifier(double beta, double gamma, double exponent, size_t cells) {
    double length[HYST_BOUC_WEN_MAX_CELLS], rise[HYST_BOUC_WEN_MAX_CELLS];
    hyst_q31_t lengths[HYST_BOUC_WEN_MAX_CELLS];
    hyst_q28_t slopes[HYST_BOUC_WEN_MAX_CELLS];
    bouc_wen_t model;
    bouc_wen_open(&model, beta, gamma, exponent);
    bouc_wen_cells(&model, 2.0, cells, length, rise);
    const double share = -0.25 / fmax(1.0, 2.0 * beta / (beta + gamma)); /* direct + share * slope > 0 */
    for (size_t i = 0; i < cells; i++) {
        lengths[i] = (hyst_q31_t)lround(length[i] * 0x1p31);
        slopes[i] = (hyst_q28_t)lround(share * rise[i] / length[i] * 0x1p28);
    }
    hyst_bouc_wen_t amplifier;
    uint32_t element = 0;
    TEST_ASSERT_EQUAL_INT(HYST_BOUC_WEN_OK, hyst_bouc_wen_build(&amplifier, (uint32_t)cells, 0, HYST_Q28_ONE / 2,
                                                                lengths, slopes, &element));
    hyst_bouc_wen_state_t state;
    hyst_bouc_wen_reset(&amplifier, &state, 0);
    double worst = 0.0, largest = 0.0;
    for (int k = 1; k < 20000; k++) {
        const double u = 0.9 * sin(k * 0.01) * (0.55 + 0.45 * cos(k * 0.00071));
        const double h = bouc_wen_step(&model, u);
        const double position = hyst_bouc_wen_forward(&amplifier, &state, (hyst_q31_t)lround(u * 0x1p31)) * 0x1p-31;
        worst = fmax(worst, fabs((position - 0.5 * u) / share - h));
        largest = fmax(largest, fabs(h));
    }
    return worst / largest;
}

/* Errors go as 1 / cells^2; 4 / cells^2 of the largest h is what tests/unit/test_bouc_wen.c allows its own cells. */
static void test_cells_follow_the_curve(void) {
    static const struct {
        double beta, gamma, exponent;
    } kinds[] = {{1.0, 1.0, 1.0}, {3.0, 1.0, 1.0}, {1.0, -0.5, 1.0}, {2.0, 2.0, 2.0}, {8.0, 4.0, 1.5}, {1.0, 0.0, 5.0}};
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        const double coarse = through_the_amplifier(kinds[k].beta, kinds[k].gamma, kinds[k].exponent, 16);
        const double fine = through_the_amplifier(kinds[k].beta, kinds[k].gamma, kinds[k].exponent, 64);
        printf("beta %.0f gamma %2.0f n %.1f: off by %.1e of h with 16 cells, %.1e with 64\n", kinds[k].beta,
               kinds[k].gamma, kinds[k].exponent, coarse, fine);
        TEST_ASSERT_TRUE(coarse < 4.0 / (16.0 * 16.0));
        TEST_ASSERT_TRUE(fine < 4.0 / (64.0 * 64.0));
    }
}

static void make_model(model_t *model, double hysteretic_um, double feedback) {
    const double terms[] = {feedback, 0.0, 0.0};
    model_create(model, 10000.0);
    model_block_t *block = model_append(model, &block_bouc_wen);
    model_set(block, "offset_um", 3.0);
    model_set(block, "direct_um", 12.0);
    model_set(block, "hysteretic_um", hysteretic_um);
    model_set(block, "beta", 1.5);
    model_set(block, "gamma", 0.5);
    model_set(block, "center_v", 10.0);
    model_set(block, "half_range_v", 40.0);
    model_set_array(block, "feedback", 3, terms, NULL);
}

/* Compiled for another range than the model's own: the reference comes out of the model, but for the chords. */
static void test_compiled_it_inverts_the_model(void) {
    enum { SWEEP = 1000, SAMPLES = 3000 };
    const compile_options_t options = {.drive_range_v = {-40.0, 80.0}, .position_range_um = {-20.0, 25.0}};
    static hyst_compensator_t compensator;
    static hyst_compensator_state_t state;
    hyst_parameters_t parameters;
    compile_report_t report;
    failure_t failure = {{0}};
    model_t model;
    double worst = 0.0;
    make_model(&model, -3.0, 0.0);
    TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, &report, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(&parameters, &compensator).error);
    chain_t *chain = chain_open(&model, 10000.0, 1, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    hyst_compensator_reset(&compensator, &state);
    chain_settle(chain, drive_to_volts(&parameters, parameters.drive_park));
    for (int k = 0; k < SWEEP + SAMPLES; k++) {
        const double y = 3.0 + 8.0 * sin(0.02 * k);
        const hyst_q31_t swept = k % 500 < 250 ? parameters.drive_low : parameters.drive_high;
        unsigned events;
        const hyst_q31_t drive = k < SWEEP
                                     ? hyst_compensator_step(&compensator, &state, HYST_MODE_DIRECT, swept, &events)
                                     : hyst_compensator_step(&compensator, &state, HYST_MODE_COMPENSATE,
                                                             position_from_micrometres(&parameters, y), &events);
        const double position = chain_step(chain, drive_to_volts(&parameters, drive));
        if (k >= SWEEP + SAMPLES / 2) {
            TEST_ASSERT_EQUAL_UINT(0, events);
            worst = fmax(worst, fabs(position - y));
        }
    }
    printf("compiled: off by %.2g um of 16 um, 3 um of them hysteretic\n", worst);
    /* 4 / 64^2 of h, which the limit 1 / (beta + gamma) = 1/2 keeps below 1.5 um; once for the memory, once for the
     * chord. */
    TEST_ASSERT_TRUE(worst < 2.0 * 1.5 * 4.0 / 4096.0);
    chain_close(chain);
    model_free(&model);
}

/* A past is as if the drive had gone there, from the middle on, and then to the first sample: to rounding. It matters:
 * without it the first sample is elsewhere. */
static void test_a_past_is_where_the_drive_was(void) {
    static const double past_v[] = {47.0, -21.0, 33.0}, first_v = 5.0, then_v = 18.0;
    failure_t failure = {{0}};
    model_t model, with_past;
    make_model(&model, -3.0, 0.0);
    make_model(&with_past, -3.0, 0.0);
    model_set_array(&with_past.block[0], "past_v", 3, past_v, NULL);
    chain_t *walked = chain_open(&model, 10000.0, 1, &failure), *fresh = chain_open(&model, 10000.0, 1, &failure);
    chain_t *chain = chain_open(&with_past, 10000.0, 1, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    (void)chain_settle(walked, 10.0);
    for (size_t i = 0; i < 3; i++) {
        (void)chain_step(walked, past_v[i]);
    }
    const double here = chain_step(walked, first_v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, here, chain_settle(chain, first_v));
    TEST_ASSERT_TRUE(fabs(chain_settle(fresh, first_v) - here) > 0.1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, chain_step(walked, then_v), chain_step(chain, then_v));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, here, chain_settle(chain, first_v)); /* and once more from the beginning */
    chain_close(walked);
    chain_close(fresh);
    chain_close(chain);
    model_free(&model);
    model_free(&with_past);
}

static void test_what_the_amplifier_cannot_run_is_refused(void) {
    const compile_options_t options = {.drive_range_v = {-40.0, 80.0}, .position_range_um = {-20.0, 25.0}};
    hyst_parameters_t parameters;
    failure_t failure = {{0}};
    model_t model;
    make_model(&model, -3.0, 0.5);
    TEST_ASSERT_FALSE(compile_model(&model, &options, &parameters, NULL, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "feedback"), failure.text);
    model_free(&model);
    /* Just after a reversal the slope is 12 - 10 * 2 beta / (beta + gamma) < 0. */
    make_model(&model, -10.0, 0.0);
    TEST_ASSERT_FALSE(compile_model(&model, &options, &parameters, NULL, &failure));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(failure.text, "bouc_wen_slope"), failure.text);
    model_free(&model);
}

int main(void) {
    rng = random_start("test_bouc_wen", 20261121);
    UNITY_BEGIN();
    RUN_TEST(test_exponent_1_is_exponentials);
    RUN_TEST(test_sampling_does_not_matter);
    RUN_TEST(test_the_curve_is_the_equation);
    RUN_TEST(test_cells_follow_the_curve);
    RUN_TEST(test_compiled_it_inverts_the_model);
    RUN_TEST(test_a_past_is_where_the_drive_was);
    RUN_TEST(test_what_the_amplifier_cannot_run_is_refused);
    return UNITY_END();
}
