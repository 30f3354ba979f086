/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Stop form, inertia and preload: blocks against the operator definitions, each other, and integration in small steps.
 */
#include "chain/catalogue.h"
#include "elements/stop_bank.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <stdlib.h>

enum { MAX_STOPS = 12 };

typedef struct {
    size_t stops;
    double offset, weight[MAX_STOPS + 1], threshold[MAX_STOPS];
} spring_t;

void setUp(void) {
}
void tearDown(void) {
}

/* Slopes positive, single weights of either sign. */
static spring_t random_spring(random_t *random) {
    spring_t spring = {.stops = (size_t)random_between(random, 0, MAX_STOPS), .offset = 20.0 * random_unit(random)};
    double slope = 0.5 + random_unit(random), threshold = 0.0;
    spring.weight[0] = slope;
    for (size_t i = spring.stops; i-- > 0;) {
        const double next = 0.2 + 3.0 * random_unit(random);
        spring.weight[i + 1] = next - slope;
        slope = next;
    }
    for (size_t i = 0; i < spring.stops; i++) {
        threshold += 0.05 + random_unit(random);
        spring.threshold[i] = threshold;
    }
    return spring;
}

static const spring_t plain = {4, 3.0, {2.0, 0.8, 0.5, 0.4, 0.3}, {1.0, 2.0, 3.0, 4.0}};

static model_block_t *set_spring(model_block_t *block, const spring_t *spring) {
    model_set(block, "offset_v", spring->offset);
    model_set_array(block, "weights", spring->stops + 1, spring->weight, NULL);
    model_set_array(block, "thresholds_um", spring->stops, spring->threshold, NULL);
    return block;
}

static chain_t *open_chain(model_t *model, double rate_hz, double preload_n) {
    failure_t failure = {{0}};
    chain_t *chain = chain_open_preloaded(model, rate_hz, 1, preload_n, &failure);
    TEST_ASSERT_NOT_NULL_MESSAGE(chain, failure.text);
    model_free(model);
    return chain;
}

static chain_t *open_stop(const spring_t *spring) {
    model_t model;
    model_create(&model, 1000.0);
    set_spring(model_append(&model, &block_stop_prandtl_ishlinskii), spring);
    return open_chain(&model, 1000.0, 0.0);
}

static chain_t *open_inertial(const spring_t *spring, double damping, double mass, double rate_hz) {
    model_t model;
    model_create(&model, rate_hz);
    model_block_t *block = set_spring(model_append(&model, &block_inertial_hysteresis), spring);
    model_set(block, "damping_v_s_per_um", damping);
    model_set(block, "mass_v_s2_per_um", mass);
    return open_chain(&model, rate_hz, 0.0);
}

/* The stop operator as the source defines it (000, equations 1 and 2), from rest at 0. */
typedef struct {
    double input, output[MAX_STOPS];
} stops_t;

static double stop_sum(const spring_t *spring, stops_t *stops, double x) {
    double sum = spring->offset + spring->weight[0] * x;
    for (size_t i = 0; i < spring->stops; i++) {
        const double r = spring->threshold[i];
        stops->output[i] = fmax(-r, fmin(r, x - stops->input + stops->output[i]));
        sum += spring->weight[i + 1] * stops->output[i];
    }
    stops->input = x;
    return sum;
}

/* Jumps, crawls and rests. */
static double next_drive(random_t *random, double drive) {
    switch (random_between(random, 0, 3)) {
    case 0:
        return 80.0 * random_unit(random) - 40.0;
    case 1:
        return drive;
    default:
        return fmax(-40.0, fmin(40.0, drive + random_normal(random)));
    }
}

static void test_stop_sum_of_the_position_is_the_drive(void) {
    random_t random = random_start("stop_composition", 31);
    double worst = 0.0;
    for (int bank = 0; bank < 200; bank++) {
        const spring_t spring = random_spring(&random);
        chain_t *chain = open_stop(&spring);
        stops_t stops = {0};
        double drive = 0.0;
        stop_sum(&spring, &stops, chain_settle(chain, 0.0));
        for (int k = 0; k < 500; k++) {
            drive = next_drive(&random, drive);
            worst = fmax(worst, fabs(stop_sum(&spring, &stops, chain_step(chain, drive)) - drive));
        }
        chain_close(chain);
    }
    printf("worst composition error %.2g V\n", worst);
    /* Numbers up to 1000 V, each rounded to 2^-53 of it, and no more than some hundred roundings until a stop is
     * reached again: 1e-11 V. */
    TEST_ASSERT_TRUE(worst < 1e-11);
}

static void test_equals_the_play_sum_of_the_inversion_formulas(void) {
    random_t random = random_start("stop_as_play", 32);
    for (int bank = 0; bank < 200; bank++) {
        const spring_t spring = random_spring(&random);
        const stop_bank_t stops = {spring.stops, spring.weight[0], spring.weight + 1, spring.threshold};
        double weight[MAX_STOPS + 1], threshold[MAX_STOPS], drive = 0.0;
        play_bank_t play = {.weight = weight, .threshold = threshold};
        model_t model;
        stop_bank_to_play(&stops, &play);
        TEST_ASSERT_EQUAL_UINT64(spring.stops, play.operators);
        make_bank_model(&model, 1000.0, 0.0, spring.stops, weight, threshold);
        chain_t *plays = open_chain(&model, 1000.0, 0.0), *chain = open_stop(&spring);
        chain_settle(plays, -spring.offset);
        chain_settle(chain, 0.0);
        for (int k = 0; k < 300; k++) {
            drive = next_drive(&random, drive);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, chain_step(plays, drive - spring.offset), chain_step(chain, drive));
        }
        chain_close(plays);
        chain_close(chain);
    }
}

static void test_without_mass_and_damping_it_is_the_stop_sum(void) {
    random_t random = random_start("massless", 33);
    chain_t *still = open_stop(&plain), *moving = open_inertial(&plain, 0.0, 0.0, 5000.0);
    double drive = 7.0;
    TEST_ASSERT_TRUE(chain_settle(still, drive) == chain_settle(moving, drive));
    for (int k = 0; k < 1000; k++) {
        drive = next_drive(&random, drive);
        TEST_ASSERT_TRUE(chain_step(still, drive) == chain_step(moving, drive));
    }
    chain_close(still);
    chain_close(moving);
}

/* A sine through a linear spring: the amplitude and phase of 1 / (k + j c w - m w^2). */
static void test_a_linear_spring_answers_a_sine_like_its_transfer_function(void) {
    const spring_t linear = {.stops = 0, .weight = {3.8}};
    const double rate = 20000.0, damping = 1.2e-3, mass = 1.5e-7, omega = 2.0 * M_PI * 200.0;
    const double stiff = linear.weight[0] - mass * omega * omega, loss = damping * omega;
    chain_t *chain = open_inertial(&linear, damping, mass, rate);
    double in_phase = 0.0, quadrature = 0.0;
    chain_settle(chain, 0.0);
    for (int k = 0; k < 6000; k++) {
        const double phase = omega * k / rate, x = chain_step(chain, sin(phase));
        if (k >= 4000) { /* 20 whole periods, 20 decay times later */
            in_phase += x * sin(phase) / 1000.0;
            quadrature += x * cos(phase) / 1000.0;
        }
    }
    /* The trapezoidal rule turns omega into tan(omega dt / 2) * 2 / dt, 3.3e-4 more. */
    TEST_ASSERT_DOUBLE_WITHIN(4e-4, 1.0, hypot(in_phase, quadrature) * hypot(stiff, loss));
    TEST_ASSERT_DOUBLE_WITHIN(4e-4, -atan2(loss, stiff), atan2(quadrature, in_phase));
    chain_close(chain);
}

/* The same mass by Euler-Cromer steps so small that they do not matter (error of first order: below 1e-5 um here). */
static double integrate_finely(stops_t *stops, double state[2], double from_v, double to_v, double damping, double mass,
                               double dt) {
    enum { STEPS = 2000 };
    for (int i = 1; i <= STEPS; i++) {
        const double drive = from_v + (to_v - from_v) * i / STEPS, h = dt / STEPS;
        state[1] += h / mass * (drive - damping * state[1] - stop_sum(&plain, stops, state[0]));
        state[0] += h * state[1];
    }
    return state[0];
}

static double worst_integration_error(int per_period) {
    const double f = 200.0, dt = 1.0 / (f * per_period), damping = 1e-3, mass = 3e-7; /* mode at 580 Hz and below */
    chain_t *chain = open_inertial(&plain, damping, mass, 1.0 / dt);
    stops_t stops = {0};
    double state[2] = {chain_settle(chain, plain.offset), 0.0}, worst = 0.0, drive = plain.offset;
    stop_sum(&plain, &stops, state[0]);
    for (int k = 1; k <= 3 * per_period; k++) {
        const double next = plain.offset + 20.0 * (1.0 - cos(2.0 * M_PI * f * dt * k));
        const double fine = integrate_finely(&stops, state, drive, next, damping, mass, dt);
        worst = fmax(worst, fabs(chain_step(chain, next) - fine));
        drive = next;
    }
    chain_close(chain);
    return worst;
}

static void test_inertia_converges_with_the_square_of_the_sample_time(void) {
    const double coarse = worst_integration_error(50), fine = worst_integration_error(200);
    printf("integration error %.3g um at 10 kHz, %.3g um at 40 kHz\n", coarse, fine);
    TEST_ASSERT_TRUE(coarse < 0.03);        /* of a stroke of 13 um */
    TEST_ASSERT_TRUE(fine < coarse / 12.0); /* 16, but for the corners of the stops and the reference's own error */
}

/* Differences that look backwards are exact on a parabola. */
static void test_inertial_terms_on_a_parabola(void) {
    const double rate = 1000.0, c = 3e-3, m = 2e-5, one = 1.0;
    model_t model;
    model_create(&model, rate);
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
    model_block_t *block = model_append(&model, &block_inertial_terms);
    model_set(block, "damping_s", c);
    model_set(block, "mass_s2", m);
    chain_t *chain = open_chain(&model, rate, 0.0);
    TEST_ASSERT_EQUAL_DOUBLE(5.0, chain_settle(chain, 5.0));
    for (int k = 0; k < 100; k++) {
        const double t = k / rate, u = 5.0 + 40.0 * t + 300.0 * t * t;
        const double y = chain_step(chain, u);
        if (k >= 2) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, u - c * (40.0 + 600.0 * t) - m * 600.0, y);
        }
    }
    chain_close(chain);
}

/* The play form is the first-order expansion of a mode: what is left is the square of the lag. */
static void test_inertial_terms_are_a_mode_to_first_order(void) {
    const double rate = 100000.0, f0 = 2000.0, zeta = 0.3, one = 1.0, omega = 2.0 * M_PI * f0;
    double left[2];
    for (int i = 0; i < 2; i++) {
        const double f = i == 0 ? 100.0 : 50.0;
        chain_t *chain[2];
        for (int form = 0; form < 2; form++) {
            model_t model;
            model_create(&model, rate);
            model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
            model_block_t *block = model_append(&model, form == 0 ? &block_resonance : &block_inertial_terms);
            model_set(block, form == 0 ? "frequency_hz" : "damping_s", form == 0 ? f0 : 2.0 * zeta / omega);
            model_set(block, form == 0 ? "damping_ratio" : "mass_s2", form == 0 ? zeta : 1.0 / (omega * omega));
            chain[form] = open_chain(&model, rate, 0.0);
            chain_settle(chain[form], 0.0);
        }
        left[i] = 0.0;
        for (int k = 0; k < 4000; k++) {
            const double u = sin(2.0 * M_PI * f * k / rate);
            const double difference = fabs(chain_step(chain[0], u) - chain_step(chain[1], u));
            left[i] = k >= 2000 ? fmax(left[i], difference) : 0.0;
        }
        /* |(c s + m s^2)^2 / (1 + c s + m s^2)|, and 2 % for the differences */
        const double lag = 2.0 * zeta * f / f0, lead = f * f / (f0 * f0);
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * left[i], (lag * lag + lead * lead) / hypot(1.0 - lead, lag), left[i]);
        chain_close(chain[0]);
        chain_close(chain[1]);
    }
    TEST_ASSERT_TRUE(left[1] < 0.27 * left[0]);
}

static double preloaded(double compliance, double force, double shift, double spring, double recorded_n, double u) {
    const double one = 1.0;
    model_t model;
    model_create(&model, 1000.0);
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
    model_block_t *block = model_append(&model, &block_preload);
    model_set(block, "compliance_per_n", compliance);
    if (force >= 0.0) {
        model_set(block, "force_n", force);
    }
    model_set(block, "shift_um_per_n", shift);
    model_set(block, "spring_n_per_um", spring);
    chain_t *chain = open_chain(&model, 1000.0, recorded_n);
    const double at_rest = chain_settle(chain, u), next = chain_step(chain, u);
    TEST_ASSERT_TRUE(at_rest == next);
    chain_close(chain);
    return next;
}

static void test_preload_balances_the_forces(void) {
    const double u = 21.0, s = 0.02, kappa = 0.4, k = 1.5, force = 8.0;
    const double y = preloaded(s * kappa, -1.0, s, k, force, u);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, u - s * (force + (k + kappa * force) * y), y);
    TEST_ASSERT_TRUE(preloaded(s * kappa, force, s, k, 99.0, u) == y); /* its own force, not the recording's */
    TEST_ASSERT_EQUAL_DOUBLE(u, preloaded(0.01, -1.0, 0.0, 5.0, 0.0, u));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, u / 1.04, preloaded(0.01, -1.0, 0.0, 5.0, 4.0, u));
}

static void test_preload_of_a_recording(void) {
    static const char *const refused[] = {"-1", "heavy", "", "4 N", "nan"};
    const double one = 1.0;
    double position[4];
    recording_t recording;
    model_t model;
    failure_t failure;
    recording_create(&recording, "pressed", 1000.0, 4);
    for (size_t k = 0; k < 4; k++) {
        recording.column[COLUMN_DRIVE][k] = 10.0;
    }
    model_create(&model, 1000.0);
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, &one, NULL);
    model_set(model_append(&model, &block_preload), "compliance_per_n", 0.025);
    TEST_ASSERT_TRUE(chain_simulate(&model, &recording, 1, position, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(10.0, position[3]);
    recording_set_key(&recording, "preload_n", "10");
    TEST_ASSERT_TRUE(chain_simulate(&model, &recording, 1, position, &failure));
    TEST_ASSERT_EQUAL_DOUBLE(8.0, position[3]);
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        recording_set_key(&recording, "preload_n", refused[i]);
        TEST_ASSERT_FALSE(chain_simulate(&model, &recording, 1, position, &failure));
        expect_line(&failure, "pressed: header key preload_n is '");
    }
    model_free(&model);
    recording_free(&recording);
}

static void test_refuses_springs_without_an_inverse(void) {
    static const struct {
        spring_t spring;
        size_t weights, memory;
        const char *line;
    } bad[] = {{{2, 0.0, {1.0, 1.0, -1.0}, {1.0, 2.0}}, 3, 0, "does not rise with the position"},
               {{2, 0.0, {0.0, 1.0, 1.0}, {1.0, 2.0}}, 3, 0, "does not rise with the position"},
               {{2, 0.0, {1.0, -3.0, 1.0}, {1.0, 2.0}}, 3, 0, "does not rise with the position"},
               {{2, 0.0, {1.0, 1.0, 1.0}, {2.0, 2.0}}, 3, 0, "thresholds_um[1] does not rise"},
               {{2, 0.0, {1.0, 1.0, 1.0}, {1.0, 2.0}}, 2, 0, "2 weights for 2 thresholds"},
               {{2, 0.0, {1.0, 1.0, 1.0}, {1.0, 2.0}}, 3, 1, "1 values of initial memory for 2 thresholds"}};
    const block_t *const blocks[] = {&block_stop_prandtl_ishlinskii, &block_inertial_hysteresis};
    for (size_t i = 0; i < 2 * sizeof bad / sizeof bad[0]; i++) {
        model_t model;
        failure_t failure;
        model_create(&model, 1000.0);
        model_block_t *block = set_spring(model_append(&model, blocks[i % 2]), &bad[i / 2].spring);
        model_set_array(block, "weights", bad[i / 2].weights, bad[i / 2].spring.weight, NULL);
        model_set_array(block, "initial_memory_um", bad[i / 2].memory, bad[i / 2].spring.threshold, NULL);
        TEST_ASSERT_FALSE_MESSAGE(model_check(&model, "model", &failure), bad[i / 2].line);
        expect_line(&failure, bad[i / 2].line);
        expect_line(&failure, blocks[i % 2]->name);
        model_free(&model);
    }
}

/* Plays of the drive, followed by hand, say what the plays of the position are. */
static void test_memory_of_the_inverse_is_that_of_the_spring(void) {
    random_t random = random_start("stop_memory_map", 35);
    for (int round = 0; round < 100; round++) {
        const spring_t spring = random_spring(&random);
        const stop_bank_t bank = {spring.stops, spring.weight[0], spring.weight + 1, spring.threshold};
        double weight[MAX_STOPS + 1], threshold[MAX_STOPS], play_v[MAX_STOPS] = {0}, play_um[MAX_STOPS] = {0};
        double mapped[MAX_STOPS], drive = 0.0;
        play_bank_t inverse = {.weight = weight, .threshold = threshold};
        stop_bank_to_play(&bank, &inverse);
        for (int k = 0; k < 100; k++) {
            drive = next_drive(&random, drive);
            stop_bank_advance(&bank, play_um, stop_bank_solve(&bank, play_um, 0.0, drive));
            for (size_t i = 0; i < spring.stops; i++) {
                play_v[i] = fmax(drive - threshold[i], fmin(drive + threshold[i], play_v[i]));
            }
            stop_bank_memory(&bank, play_v, mapped);
            for (size_t i = 0; i < spring.stops; i++) {
                TEST_ASSERT_DOUBLE_WITHIN(1e-10, play_um[i], mapped[i]);
            }
        }
    }
}

/* Memories that no past leaves: the block makes them a possible one, and the composition holds from then on. */
static void test_any_initial_memory_is_made_possible(void) {
    random_t random = random_start("stop_memory", 34);
    for (int i = 0; i < 200; i++) {
        spring_t spring = random_spring(&random);
        double memory[MAX_STOPS], drive = 60.0 * random_unit(&random);
        stops_t stops = {0};
        model_t model;
        for (size_t s = 0; s < spring.stops; s++) {
            memory[s] = 30.0 * random_normal(&random);
        }
        model_create(&model, 1000.0);
        model_block_t *block = set_spring(model_append(&model, &block_stop_prandtl_ishlinskii), &spring);
        model_set_array(block, "initial_memory_um", spring.stops, memory, NULL);
        chain_t *chain = open_chain(&model, 1000.0, 0.0);
        const double low = chain_settle(chain, drive), high = chain_step(chain, drive);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, low, high);
        /* Two moves past every threshold wipe the memory out, whatever it was. */
        for (int k = 0; k < 100; k++) {
            drive = k == 0 ? 1e4 : k == 1 ? -1e4 : next_drive(&random, drive);
            const double answer = stop_sum(&spring, &stops, chain_step(chain, drive));
            TEST_ASSERT_DOUBLE_WITHIN(k == 0 ? 1e6 : 1e-7, drive, answer);
        }
        chain_close(chain);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_stop_sum_of_the_position_is_the_drive);
    RUN_TEST(test_equals_the_play_sum_of_the_inversion_formulas);
    RUN_TEST(test_memory_of_the_inverse_is_that_of_the_spring);
    RUN_TEST(test_any_initial_memory_is_made_possible);
    RUN_TEST(test_without_mass_and_damping_it_is_the_stop_sum);
    RUN_TEST(test_a_linear_spring_answers_a_sine_like_its_transfer_function);
    RUN_TEST(test_inertia_converges_with_the_square_of_the_sample_time);
    RUN_TEST(test_inertial_terms_on_a_parabola);
    RUN_TEST(test_inertial_terms_are_a_mode_to_first_order);
    RUN_TEST(test_preload_balances_the_forces);
    RUN_TEST(test_preload_of_a_recording);
    RUN_TEST(test_refuses_springs_without_an_inverse);
    return UNITY_END();
}
