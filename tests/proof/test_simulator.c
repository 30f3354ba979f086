/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The simulator against what it claims: if it is wrong, the proof proves nothing. */
#include "simulate.h"
#include "unity.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static random_t chance;
static const double pi = 3.14159265358979323846;

void setUp(void) {
}
void tearDown(void) {
}

static case_t bare_case(source_t source, excitation_kind_t excitation) {
    case_t item = {.actuator = actuator_draw(source, &chance),
                   .excitation = excitation,
                   .sample_rate_hz = 1000.0,
                   .recordings = 1,
                   .seed = random_bits(&chance)};
    return item;
}

static excitation_t excitation_of(const case_t *item) {
    random_t random = {item->seed};
    return excitation_make(item->excitation, item->sample_rate_hz, item->actuator.low_v, item->actuator.high_v,
                           &random);
}

/* Relays one by one: 160 000 of them, each with its own switching drives, against the staircase and its closed form. */
static void test_plane_is_its_relays(void) {
    enum { SIDE = 400, STEPS = 60 };
    const double cell = 2.0 / SIDE;
    actuator_t plane = actuator_draw(SOURCE_PLANE, &chance);
    bool *on = proof_allocate((size_t)SIDE * SIDE, sizeof *on);
    double drive_v[STEPS], expected[STEPS], whole = 0.0;
    const double middle_v = 0.5 * (plane.high_v + plane.low_v), half_v = 0.5 * (plane.high_v - plane.low_v);
    for (int k = -2; k < STEPS; k++) {
        const bool top = plane.from_above ? k == -1 : k == -2;
        const double u = k < 0 ? (top ? 1.0 : -1.0) : 2.0 * random_unit(&chance) - 1.0;
        double sum = 0.0;
        whole = 0.0;
        for (size_t i = 0; i < SIDE; i++) {
            for (size_t j = 0; j <= i; j++) {
                const double up = -1.0 + cell * ((double)i + 0.5), down = -1.0 + cell * ((double)j + 0.5);
                const double r = 0.5 * (up - down), c = 0.5 * (up + down);
                /* Of the cells on the diagonal only half lies in the plane. */
                const double weight =
                    exp(-r / plane.density_scale) * (1.0 + plane.curvature * c * c) * (i == j ? 0.5 : 1.0);
                bool *relay = &on[i * SIDE + j];
                *relay = (*relay || u >= up) && u > down;
                sum += *relay ? weight : 0.0;
                whole += weight;
            }
        }
        if (k >= 0) {
            drive_v[k] = middle_v + half_v * u;
            expected[k] = (1.0 - plane.hysteretic) * u + 2.0 * plane.hysteretic * sum / whole;
        }
    }
    actuator_move(&plane, NULL, drive_v, STEPS);
    for (int k = 1; k < STEPS; k++) {
        /* The relays see the drive in steps of a cell, so their sum is off by up to the hysteretic slope, about 4
         * times the part, times a cell. */
        const double moved = (drive_v[k] - drive_v[0]) / plane.um_per_half_range;
        TEST_ASSERT_DOUBLE_WITHIN(8.0 * plane.hysteretic * cell, expected[k] - expected[0], moved);
    }
    free(on);
}

/* Falling branches lie above rising ones, without endy source. */
static void test_hysteresis_lags(void) {
    for (int source = 0; source < SOURCE_COUNT; source++) {
        case_t item = bare_case((source_t)source, EXCITATION_SINE);
        excitation_t sine = excitation_of(&item);
        item.actuator.noise_um = 0.0;
        double *reading = simulate(&item, 0, &sine);
        /* 1 Hz from the middle upwards: at half a second it falls through the middle, at one second it rises. */
        const double width = (reading[2500] - reading[2000]) / (2.0 * item.actuator.um_per_half_range);
        TEST_ASSERT_DOUBLE_WITHIN(0.14, 0.16, width);
        excitation_free(&sine);
        free(reading);
    }
}

/* Without an effect nothing knows the time: the same drive at another rate gives the same positions. */
static void test_bare_actuator_is_rate_independent(void) {
    for (int source = 0; source < SOURCE_COUNT; source++) {
        case_t item = bare_case((source_t)source, EXCITATION_SHORT);
        excitation_t drive = excitation_of(&item), slower = drive;
        double *reading = simulate(&item, 0, &drive);
        slower.sample_rate_hz /= 3.0;
        double *again = simulate(&item, 0, &slower);
        TEST_ASSERT_EQUAL_DOUBLE_ARRAY(reading, again, drive.samples);
        excitation_free(&drive);
        free(reading);
        free(again);
    }
}

/* Root mean square of an effect's answer to a sine, over that of the sine, in its last half. */
static double gain_at(const char *name, double hz, const double *parameter) {
    enum { COUNT = 80000 };
    double *value = proof_allocate(COUNT, sizeof *value), in = 0.0, out = 0.0;
    actuator_t actuator = actuator_draw(SOURCE_PLAY, &chance);
    passage_t passage = {.value = value, .count = COUNT, .step_s = 1e-5, .drive_v = value, .actuator = &actuator};
    for (size_t k = 0; k < COUNT; k++) {
        value[k] = sin(2.0 * pi * hz * passage.step_s * (double)k);
        in += k >= COUNT / 2 ? value[k] * value[k] : 0.0;
    }
    effect_find(name)->apply(&passage, parameter);
    for (size_t k = COUNT / 2; k < COUNT; k++) {
        out += value[k] * value[k];
    }
    free(value);
    return sqrt(out / in);
}

static void test_filters_have_their_gains(void) {
    const double cutoff[] = {300.0}, mode[] = {400.0, 0.05};
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(0.5), gain_at("amplifier_bandwidth", 300.0, cutoff));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 10.0, gain_at("resonance", 400.0, mode)); /* 1 / (2 zeta) */
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 1.0 / hypot(0.75, 0.05), gain_at("resonance", 200.0, mode));
    const double fast[] = {2e5, 0.05}; /* a mode with a period of half a step */
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 1.0, gain_at("resonance", 100.0, fast));
}

/* Straight in the logarithm of time: the same growth from 1 s to 10 s as from 2 s to 20 s, gamma a decade. */
static void test_creep_is_logarithmic(void) {
    enum { COUNT = 20001 };
    const double gamma[] = {0.02};
    double *value = proof_allocate(COUNT, sizeof *value);
    passage_t passage = {.value = value, .count = COUNT, .step_s = 1e-3};
    for (size_t k = 1; k < COUNT; k++) {
        value[k] = 1.0;
    }
    effect_find("creep")->apply(&passage, gamma);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * gamma[0], gamma[0], value[10000] - value[1000]);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * gamma[0], gamma[0], value[20000] - value[2000]);
    free(value);
}

/* The sine part is the loss tangent at 0.3 Hz and at 30 Hz, of a response of 1 / (1 + 6 g) at once. */
static void test_dielectric_loss_is_the_same_at_all_frequencies(void) {
    enum { COUNT = 2000000 };
    const double loss[] = {0.02}, at_once = 1.0 + 6.0 * loss[0] * 2.0 * log(10.0) / pi, hz[] = {0.3, 30.0};
    double *value = proof_allocate(COUNT, sizeof *value);
    for (size_t i = 0; i < 2; i++) {
        passage_t passage = {.value = value, .count = COUNT, .step_s = 1e-5};
        double quadrature = 0.0;
        for (size_t k = 0; k < COUNT; k++) {
            value[k] = sin(2.0 * pi * hz[i] * passage.step_s * (double)k);
        }
        effect_find("dielectric_loss")->apply(&passage, loss);
        for (size_t k = COUNT / 2; k < COUNT; k++) {
            quadrature += value[k] * cos(2.0 * pi * hz[i] * passage.step_s * (double)k) / (COUNT / 4.0);
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * loss[0], -loss[0] / at_once, quadrature); /* six decades have ends */
    }
    free(value);
}

/* Every effect can be made as strong as the noise, and no bank of plays makes more of it. */
static void test_strengths_are_reached(void) {
    for (size_t e = 0; e < catalogue_effect_count; e++) {
        case_t item = bare_case(e % 2 == 0 ? SOURCE_PLAY : SOURCE_PLANE, EXCITATION_SHORT);
        excitation_t excitation = excitation_of(&item);
        item.effects = 1;
        item.effect[0] = (presence_t){.effect = &catalogue_effects[e], .strength = 1.0, .seed = random_bits(&chance)};
        if (strcmp(catalogue_effects[e].name, "preload") == 0) {
            item.recordings = 2;
            item.preload_n[1] = 10.0;
        }
        reach_strengths(&item, &excitation);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.03, 1.0, item.effect[0].strength, catalogue_effects[e].name);
        TEST_ASSERT_TRUE_MESSAGE(item.effect[0].visible <= item.effect[0].strength, catalogue_effects[e].name);
        excitation_free(&excitation);
    }
}

/* Every effect that no catalogue has is there with at least half of the strength that was requested, on every source
 * and wherever the stroke lies: some come in steps, or only in a part of the stroke. */
static void test_unknown_effects_are_there(void) {
    for (size_t e = 0; e < unknown_effect_count; e++) {
        for (size_t source = 0; source < SOURCE_COUNT; source++) {
            case_t item = bare_case((source_t)source, EXCITATION_SHORT);
            excitation_t excitation = excitation_of(&item);
            item.effects = 1;
            item.effect[0] = (presence_t){.effect = &unknown_effects[e], .strength = 3.0, .seed = random_bits(&chance)};
            reach_strengths(&item, &excitation);
            TEST_ASSERT_TRUE_MESSAGE(item.effect[0].strength > 1.5, unknown_effects[e].name);
            excitation_free(&excitation);
        }
    }
}

static void test_noise_is_as_told(void) {
    static const double correlation[] = {0.0, 0.9};
    for (size_t i = 0; i < 2; i++) {
        case_t item = bare_case(SOURCE_PLAY, EXCITATION_MULTISINE), silent = item;
        item.actuator.noise_correlation = correlation[i];
        silent.actuator.noise_um = 0.0;
        excitation_t excitation = excitation_of(&item);
        double *noisy = simulate(&item, 0, &excitation), *clean = simulate(&silent, 0, &excitation), squares = 0.0,
               products = 0.0;
        for (size_t k = 1; k < excitation.samples; k++) {
            const double now = noisy[k] - clean[k], before = noisy[k - 1] - clean[k - 1];
            squares += now * now;
            products += now * before;
        }
        /* Five standard errors of an rms of 22 000 samples, of which one in 19 counts when they are coloured. */
        const double rms = sqrt(squares / (double)(excitation.samples - 1));
        TEST_ASSERT_DOUBLE_WITHIN(i == 0 ? 0.025 : 0.11, 1.0, rms / item.actuator.noise_um);
        TEST_ASSERT_DOUBLE_WITHIN(0.035, correlation[i], products / squares);
        excitation_free(&excitation);
        free(noisy);
        free(clean);
    }
}

static void test_list_has_what_was_asked_for(void) {
    size_t count, nulls = 0, unknown = 0;
    case_t *list = cases_list(random_bits(&chance), false, &count);
    for (size_t i = 0; i < count; i++) {
        nulls += list[i].kind == CASE_NULL;
        unknown += list[i].kind == CASE_UNKNOWN;
        TEST_ASSERT_EQUAL(list[i].kind == CASE_NULL, list[i].effects == 0);
    }
    TEST_ASSERT_GREATER_OR_EQUAL(200, count);
    TEST_ASSERT_GREATER_OR_EQUAL(40, nulls);
    TEST_ASSERT_GREATER_OR_EQUAL(10, unknown);
    free(list);
}

int main(void) {
    chance = random_start("proof_simulator", 2111);
    UNITY_BEGIN();
    RUN_TEST(test_plane_is_its_relays);
    RUN_TEST(test_hysteresis_lags);
    RUN_TEST(test_bare_actuator_is_rate_independent);
    RUN_TEST(test_filters_have_their_gains);
    RUN_TEST(test_creep_is_logarithmic);
    RUN_TEST(test_dielectric_loss_is_the_same_at_all_frequencies);
    RUN_TEST(test_strengths_are_reached);
    RUN_TEST(test_unknown_effects_are_there);
    RUN_TEST(test_noise_is_as_told);
    RUN_TEST(test_list_has_what_was_asked_for);
    return UNITY_END();
}
