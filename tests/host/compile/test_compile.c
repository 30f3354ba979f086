/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Compiling: the amplifier's fixed point computes what the model says, and what cannot be compiled is refused in plain
 * words. */
#include "chain/catalogue.h"
#include "chain/chain.h"
#include "compile/compile.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <string.h>

static const uint64_t seed = 99;

void setUp(void) {
}
void tearDown(void) {
}

/* A random bank over +-half_v with mean slope near 1 of full scale. */
static void random_bank(random_t *random, model_t *model, size_t n, double half_v, double half_um) {
    double weights[HYST_PI_MAX_OPERATORS + 1], thresholds[HYST_PI_MAX_OPERATORS], r = 0.0;
    weights[0] = 0.4 * half_um / half_v;
    for (size_t i = 0; i < n; i++) {
        r += 0.8 * half_v * (0.1 + random_unit(random)) / (double)n; /* at most 0.88 of the half range */
        thresholds[i] = r;
        weights[i + 1] = 0.5 * random_unit(random) * half_um / half_v / (double)n;
    }
    make_bank_model(model, 10000.0, 0.1 * half_um * random_unit(random), n, weights, thresholds);
}

static void compile_good(const model_t *model, const compile_options_t *options, hyst_parameters_t *parameters,
                         compile_report_t *report, hyst_compensator_t *compensator) {
    failure_t failure = {{0}};
    TEST_ASSERT_TRUE_MESSAGE(compile_model(model, options, parameters, report, &failure), failure.text);
    TEST_ASSERT_EQUAL_INT(HYST_PARAMETERS_OK, hyst_parameters_build(parameters, compensator).error);
}

/* Largest difference, in parts of the position half range, over random drives after one sweep of the whole range. */
static double worst_difference(random_t *random, const model_t *model, const hyst_parameters_t *parameters,
                               const hyst_compensator_t *compensator) {
    static hyst_pi_state_t state;
    static hyst_creep_state_t creep;
    failure_t failure;
    chain_t *chain = chain_open(model, 10000.0, 1, &failure);
    double worst = 0.0, slow = 0.0;
    TEST_ASSERT_NOT_NULL(chain);
    chain_settle(chain, 0.0);
    hyst_pi_reset(&compensator->hysteresis.prandtl_ishlinskii, &state, drive_from_volts(parameters, 0.0));
    hyst_creep_settle(&compensator->creep, &creep, hyst_pi_output(&compensator->hysteresis.prandtl_ishlinskii, &state));
    for (int k = 0; k < 20000; k++) {
        const double low = drive_to_volts(parameters, HYST_Q31_MIN), high = drive_to_volts(parameters, HYST_Q31_MAX);
        const double jump = random_unit(random);
        slow = fmax(0.0, fmin(1.0, slow + 0.05 * (random_unit(random) - 0.5))); /* wanders; at times jumps anywhere */
        slow = jump < 0.01 ? random_unit(random) : slow;
        const double u = k < 300 ? (k < 100 ? low : k < 200 ? high : low) : low + (high - low) * slow;
        const hyst_q31_t drive = drive_from_volts(parameters, u);
        const double exact = chain_step(chain, drive_to_volts(parameters, drive));
        const hyst_q31_t seen = compensator->curved ? hyst_curve_apply(&compensator->drive_curve, drive) : drive;
        const hyst_q31_t elastic = hyst_pi_forward(&compensator->hysteresis.prandtl_ishlinskii, &state, seen);
        const double fixed = position_to_micrometres(
            parameters, hyst_saturate(elastic + hyst_creep_offset(&compensator->creep, &creep)));
        hyst_creep_advance(&compensator->creep, &creep, elastic);
        if (k >= 300) {
            worst = fmax(worst, fabs(exact - fixed) / (1e-6 * parameters->position_half_range_pm));
        }
    }
    chain_close(chain);
    return worst;
}

/*
 * What separates the two: n + 1 weights rounded to Q28 (half a step, 2^-29 each, on memories of at most 1), thresholds
 * and drive rounded to Q31 times a sum of weights below 1, the offset and the output rounded to Q31. 2^-29 (n + 3)
 * covers them all. Merging may cost more, so it must not have happened.
 */
static void test_fixed_point_forward_model_is_the_double_one(void) {
    random_t random = {seed};
    double worst_part = 0.0;
    for (int turn = 0; turn < 60; turn++) {
        const size_t n = (size_t)(random_unit(&random) * 64.0);
        const compile_options_t options = {.drive_range_v = {-40.0, 120.0}, .position_range_um = {-70.0, 150.0}};
        hyst_parameters_t parameters;
        compile_report_t report;
        hyst_compensator_t compensator;
        model_t model;
        random_bank(&random, &model, n, 80.0, 60.0);
        compile_good(&model, &options, &parameters, &report, &compensator);
        const double bound = 0x1p-29 * ((double)n + 3.0) + report.merge_error_um * 20.0 / 110.0;
        const double worst = worst_difference(&random, &model, &parameters, &compensator);
        TEST_ASSERT_TRUE(report.merge_error_um <= 0x1p-21 * 110.0);
        worst_part = fmax(worst_part, worst / bound);
        TEST_ASSERT_TRUE(worst <= bound);
        model_free(&model);
    }
    printf("seed %llu: worst difference is %.2f of its bound\n", (unsigned long long)seed, worst_part);
}

/*
 * Rate dependence adds the rounding of beta (Q20, half a step of it on a rate of at most 2), of the rate gain and of
 * the rate (Q30): each moves the thresholds by its error times beta, and a play operator passes on no more than the
 * change of its threshold.
 */
static void test_rate_dependent_fixed_point_is_the_double_one(void) {
    random_t random = {seed + 1};
    double worst_part = 0.0;
    for (int turn = 0; turn < 30; turn++) {
        const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-120.0, 120.0}};
        hyst_parameters_t parameters;
        compile_report_t report;
        hyst_compensator_t compensator;
        model_t model;
        model_block_t *block;
        random_bank(&random, &model, 10, 100.0, 80.0);
        block = model_append(&model, &block_rate_dependent_hysteresis);
        const double filter_samples = 2.0 + 20.0 * random_unit(&random), beta_samples = 0.8 * filter_samples;
        model_set(block, "beta_s", beta_samples / 10000.0);
        model_set(block, "rate_filter_s", filter_samples / 10000.0);
        compile_good(&model, &options, &parameters, &report, &compensator);
        model_set(block, "limit_v", report.growth_limit_v);
        const double rate_error = 0x1p-30 * filter_samples + 0x1p-31 * 2.0 * filter_samples;
        const double bound =
            0x1p-29 * 13.0 + 2.0 * 0x1p-21 + beta_samples * rate_error + report.merge_error_um * 20.0 / 120.0;
        const double worst = worst_difference(&random, &model, &parameters, &compensator);
        worst_part = fmax(worst_part, worst / bound);
        TEST_ASSERT_TRUE(worst <= bound);
        model_free(&model);
    }
    printf("seed %llu: worst difference is %.2f of its bound\n", (unsigned long long)seed + 1, worst_part);
}

/*
 * Creep adds, per cell: the gain rounded to Q31 on a level of at most 1, the level rounded to Q31 times the gain, and
 * the rate rounded to Q31 (2^-32), which after k samples has moved a level that is at most 2 away by 2^-32 * 2 k too
 * much or too little.
 */
static void test_creep_in_fixed_point_is_the_double_one(void) {
    enum { SAMPLES = 20000 };
    random_t random = {seed + 2};
    double worst_part = 0.0;
    for (int turn = 0; turn < 20; turn++) {
        const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-90.0, 150.0}};
        const double gamma = 0.04 * random_unit(&random);
        hyst_parameters_t parameters;
        compile_report_t report;
        hyst_compensator_t compensator;
        model_t model;
        random_bank(&random, &model, 10, 100.0, 60.0);
        model_set(model_append(&model, &block_creep), "gamma_per_decade", gamma);
        compile_good(&model, &options, &parameters, &report, &compensator);
        TEST_ASSERT_EQUAL_UINT32(9, parameters.creep_cells); /* 0.1 to 1000 s, two a decade */
        const double a_cell = 0x1p-32 + 0.5 * gamma * (0x1p-32 + 0x1p-31 * SAMPLES);
        const double bound = 0x1p-29 * 13.0 + 9.0 * a_cell + report.merge_error_um * 20.0 / 120.0;
        const double worst = worst_difference(&random, &model, &parameters, &compensator);
        worst_part = fmax(worst_part, worst / bound);
        TEST_ASSERT_TRUE(worst <= bound);
        model_free(&model);
    }
    printf("seed %llu: worst difference is %.2f of its bound\n", (unsigned long long)seed + 2, worst_part);
}

static void expect_refusal(const model_t *model, const compile_options_t *options, const char *line) {
    hyst_parameters_t parameters;
    failure_t failure = {{0}};
    TEST_ASSERT_FALSE_MESSAGE(compile_model(model, options, &parameters, NULL, &failure), line);
    expect_line(&failure, line);
}

/* The cells of a dielectric loss are those of creep: 13, c = tan 2 ln 10 / pi / 2 each. */
static void test_dielectric_loss_takes_the_creep_cells(void) {
    const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-90.0, 150.0}};
    random_t random = {seed + 7};
    hyst_parameters_t parameters;
    compile_report_t report;
    hyst_compensator_t compensator;
    model_t model;
    random_bank(&random, &model, 10, 100.0, 60.0);
    model_set(model_append(&model, &block_dielectric_loss), "loss_tangent", 0.02);
    compile_good(&model, &options, &parameters, &report, &compensator);
    TEST_ASSERT_EQUAL_UINT32(13, parameters.creep_cells);
    for (size_t j = 0; j < 13; j++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.0, 0x1p31 * 0.02 * M_LN10 / M_PI, parameters.creep[j].gain);
        TEST_ASSERT_DOUBLE_WITHIN(1.0, 0x1p31 * -expm1(-1e4 * pow(10.0, -0.5 * (double)j) / model.sample_rate_hz),
                                  parameters.creep[j].rate);
    }
    model_set(model_append(&model, &block_creep), "gamma_per_decade", 0.01);
    expect_refusal(&model, &options, "the amplifier has one bank of relaxations");
    model_free(&model);
}

/* Asymmetry adds the chords of the parabola, the rounding of the curve and of its nodes (1.5 units of 2^-31). */
static void test_asymmetry_in_fixed_point_is_the_double_one(void) {
    random_t random = {seed + 3};
    double worst_part = 0.0;
    for (int turn = 0; turn < 20; turn++) {
        const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-150.0, 150.0}};
        const double asymmetry = 0.4 * (2.0 * random_unit(&random) - 1.0), half_v = 80.0 + 40.0 * random_unit(&random);
        hyst_parameters_t parameters;
        compile_report_t report;
        hyst_compensator_t compensator;
        model_t model;
        model_block_t *block;
        random_bank(&random, &model, 10, 100.0, 80.0);
        block = model_append(&model, &block_asymmetric_hysteresis);
        model_set(block, "asymmetry", asymmetry);
        model_set(block, "center_v", 5.0);
        model_set(block, "half_range_v", half_v);
        compile_good(&model, &options, &parameters, &report, &compensator);
        TEST_ASSERT_EQUAL_UINT32(1, parameters.drive_curves);
        const double chord = 100.0 / HYST_CURVE_INTERVALS / half_v;
        const double curve_v = fabs(asymmetry) * chord * chord * half_v * 2.0; /* twice: a node may be an end */
        /* A drive that is off by curve_v moves the position by at most the sum of the weights, 0.9 * 0.8 um / V. */
        const double bound = 0x1p-29 * 16.0 + 0.8 * curve_v / 150.0 + report.merge_error_um * 20.0 / 150.0;
        const double worst = worst_difference(&random, &model, &parameters, &compensator);
        worst_part = fmax(worst_part, worst / bound);
        TEST_ASSERT_TRUE(worst <= bound);
        model_free(&model);
    }
    printf("seed %llu: worst difference is %.2f of its bound\n", (unsigned long long)seed + 3, worst_part);
}

static void test_linear_line_is_the_middle_of_the_major_loop(void) {
    const double weights[] = {0.5, 0.25}, threshold = 50.0;
    const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-100.0, 100.0}};
    hyst_parameters_t parameters;
    compile_report_t report;
    hyst_compensator_t compensator;
    model_t model;
    make_bank_model(&model, 10000.0, 10.0, 1, weights, &threshold);
    compile_good(&model, &options, &parameters, &report, &compensator);
    /* Operator at half the range: on the way up z = -0.5 for u < 0, then u - 0.5. Mean of u z over u in -1..1 is 1/6,
     * of u u 1/3. */
    const double slope = 0.5 + 0.25 * 0.5;
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 1.0 / slope, parameters.linear_gain * 0x1p-28);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, -0.1 / slope, parameters.linear_offset * 0x1p-31);
    TEST_ASSERT_EQUAL_INT32(HYST_Q31_MIN, parameters.drive_low); /* no recorded range is known */
    TEST_ASSERT_EQUAL_INT32(0, parameters.drive_park);
    model_free(&model);
}

static void test_ranges_default_to_the_recordings_widened(void) {
    const double weights[] = {1.0};
    const compile_options_t options = {0};
    hyst_parameters_t parameters;
    compile_report_t report;
    hyst_compensator_t compensator;
    model_t model;
    make_bank_model(&model, 10000.0, 0.0, 0, weights, NULL);
    model.fit = json_pack("{s:[f,f], s:[f,f]}", "drive_range_v", 20.0, 120.0, "displacement_range_um", 0.0, 200.0);
    compile_good(&model, &options, &parameters, &report, &compensator);
    TEST_ASSERT_EQUAL_INT32(70000000, parameters.drive_center_uv);
    TEST_ASSERT_EQUAL_INT32(52500000, parameters.drive_half_range_uv);
    TEST_ASSERT_EQUAL_INT32(105000000, parameters.position_half_range_pm);
    /* Never beyond what was recorded; 0 V is outside, so it parks at the nearest drive. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 20.0, drive_to_volts(&parameters, parameters.drive_low));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 120.0, drive_to_volts(&parameters, parameters.drive_high));
    TEST_ASSERT_EQUAL_INT32(parameters.drive_low, parameters.drive_park);
    /* Unless the recordings say which converters made them. */
    json_object_set_new(model.fit, "drive_converter_v", json_pack("[f, f]", -10.0, 150.0));
    compile_good(&model, &options, &parameters, &report, &compensator);
    TEST_ASSERT_EQUAL_INT32(70000000, parameters.drive_center_uv);
    TEST_ASSERT_EQUAL_INT32(80000000, parameters.drive_half_range_uv);
    TEST_ASSERT_EQUAL_INT32(105000000, parameters.position_half_range_pm);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 120.0, drive_to_volts(&parameters, parameters.drive_high));
    model_free(&model);
}

/* The largest error of a sine of 50 um through compensator and chain, of its amplitude, beside the sine later by the
 * lookahead. */
static double worst_error(const model_t *model, const hyst_parameters_t *parameters, const compile_report_t *report,
                          const hyst_compensator_t *compensator, double f) {
    hyst_compensator_state_t state;
    failure_t failure;
    double worst = 0.0;
    const double rate = model->sample_rate_hz;
    chain_t *chain = chain_open(model, rate, 1, &failure);
    hyst_compensator_reset(compensator, &state);
    chain_settle(chain, 0.0);
    const double delay = parameters->lookahead_samples + report->lookahead_remainder_s * rate;
    for (int k = 0; k < 4000; k++) {
        unsigned events;
        const double y = 50.0 * sin(2.0 * M_PI * f * k / rate);
        const hyst_q31_t drive = hyst_compensator_step(compensator, &state, HYST_MODE_COMPENSATE,
                                                       position_from_micrometres(parameters, y), &events);
        const double position = chain_step(chain, drive_to_volts(parameters, drive));
        if (k > 2000) {
            worst = fmax(worst, fabs(position - 50.0 * sin(2.0 * M_PI * f * (k - delay) / rate)) / 50.0);
        }
    }
    chain_close(chain);
    return worst;
}

/*
 * A 100 Hz reference through the inverse filters, then through the lag at 1.5 kHz and the mode at 1 kHz, comes out as
 * itself, later by the lookahead. What the roll-offs leave: of the mode, at a tenth of its frequency, 0.0005 in phase
 * and 0.0002 in amplitude; of the lag, rolled off at 2 kHz, 0.0013 in amplitude; interpolation to the fraction of a
 * sample at most 0.0005, first-order hold 0.0003. 0.003 in all, where lag and mode alone are 0.07 late in phase.
 */
static void test_inverse_of_a_mode_and_a_lag(void) {
    const double weights[] = {1.0}, rate = 10000.0, f = 100.0;
    const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-100.0, 100.0}};
    hyst_parameters_t parameters;
    compile_report_t report;
    hyst_compensator_t compensator;
    model_t model;
    model_create(&model, rate);
    model_set(model_append(&model, &block_amplifier_bandwidth), "cutoff_hz", 1500.0);
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, weights, NULL);
    model_set(model_append(&model, &block_resonance), "frequency_hz", 1000.0);
    model_set(&model.block[2], "damping_ratio", 0.02);
    compile_good(&model, &options, &parameters, &report, &compensator);
    TEST_ASSERT_EQUAL_UINT32(2, parameters.shape_sections); /* the mode, and the fraction of a sample */
    TEST_ASSERT_EQUAL_UINT32(1, parameters.equalise_sections);
    const double worst = worst_error(&model, &parameters, &report, &compensator, f);
    printf("inverse of mode and lag: worst error %.5f of the amplitude\n", worst);
    TEST_ASSERT_TRUE(worst < 0.003);
    model_free(&model);
}

static void add_two_modes(model_t *model, double share) {
    static const double weights[] = {1.0};
    model_create(model, 10000.0);
    model_set_array(model_append(model, &block_prandtl_ishlinskii), "weights", 1, weights, NULL);
    model_block_t *modes = model_append(model, &block_two_modes);
    model_set(modes, "lower_hz", 1000.0);
    model_set(modes, "lower_damping", 0.02);
    model_set(modes, "upper_hz", 1700.0);
    model_set(modes, "upper_damping", 0.03);
    model_set(modes, "upper_share", share);
}

/* What the roll-off leaves, damping 0.7 at 1 kHz: at 200 Hz atan(0.28 / 0.96) - 0.28 = 0.004 in phase, and as the cube
 * of the frequency. Interpolation and hold: 0.0005. Between modes of one sign, or where the second opposes the first a
 * little, the antiresonance is undone, too. Above a fifth of the sample rate (2156 Hz), or with a zero in the right
 * half plane, it is not: the report says so, and what is left is (frequency / antiresonance)^2. Without an inverse 200
 * Hz are 0.03 off. */
static void test_inverse_of_two_modes(void) {
    const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-100.0, 100.0}};
    static const struct {
        double share;
        size_t uncorrected;
        double left; /* 1 / antiresonance^2, of kHz */
    } cases[] = {{0.3, 0, 0.0}, {-0.1, 0, 0.0}, {-0.2, 1, 0.215}, {-0.9, 1, 0.243}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        hyst_parameters_t parameters;
        compile_report_t report;
        hyst_compensator_t compensator;
        model_t model;
        add_two_modes(&model, cases[i].share);
        compile_good(&model, &options, &parameters, &report, &compensator);
        TEST_ASSERT_EQUAL_UINT64(cases[i].uncorrected, report.uncorrected);
        for (unsigned hz = 50; hz <= 200; hz *= 2) {
            const double f = (double)hz;
            const double worst = worst_error(&model, &parameters, &report, &compensator, f);
            printf("inverse of two modes, share %g: worst error %.5f of the amplitude at %g Hz\n", cases[i].share,
                   worst, f);
            TEST_ASSERT_TRUE(worst < 0.0005 + 0.004 * pow(f / 200.0, 3.0) + cases[i].left * pow(f / 1000.0, 2.0));
        }
        model_free(&model);
    }
}

static void test_no_filters_only_looks_ahead(void) {
    const double weights[] = {1.0};
    const compile_options_t options = {
        .drive_range_v = {-100.0, 100.0}, .position_range_um = {-100.0, 100.0}, .no_filters = true};
    hyst_parameters_t parameters;
    compile_report_t report;
    hyst_compensator_t compensator;
    model_t model;
    model_create(&model, 10000.0);
    model_set(model_append(&model, &block_transport_delay), "delay_s", 3.3e-4);
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, weights, NULL);
    model_set(model_append(&model, &block_sensor_bandwidth), "cutoff_hz", 1e4 / (2.0 * M_PI)); /* 0.1 ms */
    model_set(model_append(&model, &block_sensor_noise), "rms_um", 1.0);
    compile_good(&model, &options, &parameters, &report, &compensator);
    TEST_ASSERT_EQUAL_UINT32(0, parameters.shape_sections);
    TEST_ASSERT_EQUAL_UINT32(4, parameters.lookahead_samples);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3e-4, report.lookahead_remainder_s);
    TEST_ASSERT_EQUAL_UINT64(2, report.notes);
    TEST_ASSERT_EQUAL_UINT64(1, report.uncorrected); /* the noise */
    model_free(&model);
}

static bool is_noted(const compile_report_t *report, const char *block) {
    for (size_t i = 0; i < report->notes; i++) {
        const char *note = report->note[i];
        if (strncmp(note, block, strlen(block)) == 0 && note[strlen(block)] == ':') {
            return true;
        }
    }
    return false;
}

/* The help says that each note says how a block is undone: so each block that is undone has one. */
static void test_what_is_undone_has_a_note(void) {
    static const struct {
        const block_t *block;
        struct {
            const char *name;
            double value;
        } number[5];
    } undone[] = {{&block_transport_delay, {{"delay_s", 2e-4}}},
                  {&block_amplifier_bandwidth, {{"cutoff_hz", 500.0}}},
                  {&block_amplifier_saturation, {{"low_v", -99.0}, {"high_v", 99.0}}},
                  {&block_asymmetric_hysteresis, {{"asymmetry", 0.01}, {"center_v", 0.0}, {"half_range_v", 100.0}}},
                  {&block_rate_dependent_hysteresis, {{"beta_s", 1e-6}}},
                  {&block_creep, {{"gamma_per_decade", 0.01}}},
                  {&block_dielectric_loss, {{"loss_tangent", 0.01}}},
                  {&block_resonance, {{"frequency_hz", 300.0}, {"damping_ratio", 0.05}}},
                  {&block_two_modes,
                   {{"lower_hz", 300.0},
                    {"lower_damping", 0.05},
                    {"upper_hz", 700.0},
                    {"upper_damping", 0.05},
                    {"upper_share", 0.2}}},
                  {&block_preload, {{"compliance_per_n", 0.01}, {"force_n", 10.0}}},
                  {&block_sensor_bandwidth, {{"cutoff_hz", 500.0}}},
                  {&block_static_nonlinearity, {{"quadratic", 0.01}, {"center_um", 0.0}, {"half_range_um", 100.0}}}};
    const double weights[] = {1.0, 0.1}, thresholds[] = {10.0};
    const compile_options_t options = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-150.0, 150.0}};
    for (size_t i = 0; i < sizeof undone / sizeof undone[0]; i++) {
        hyst_parameters_t parameters;
        compile_report_t report;
        failure_t failure = {{0}};
        model_t model;
        make_bank_model(&model, 10000.0, 0.0, 1, weights, thresholds);
        model_block_t *block = model_append(&model, undone[i].block);
        for (size_t n = 0; n < 5 && undone[i].number[n].name != NULL; n++) {
            model_set(block, undone[i].number[n].name, undone[i].number[n].value);
        }
        if (undone[i].block->place == PLACE_ELECTRONICS) {
            const model_block_t bank = model.block[0];
            model.block[0] = model.block[1];
            model.block[1] = bank;
        }
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, &report, &failure), failure.text);
        TEST_ASSERT_TRUE_MESSAGE(is_noted(&report, undone[i].block->name), undone[i].block->name);
        model_free(&model);
    }
}

/* A measured delay beyond the model's: the image waits for the fraction, and what comes out is late by the whole
 * lookahead. */
static void test_a_measured_delay_is_looked_ahead_over(void) {
    const double weights[] = {1.0}, rate = 10000.0, f = 50.0;
    const struct {
        double delay_s;
        unsigned lookahead;
    } cases[] = {{0.0, 0}, {1.5e-4, 2}, {-0.25e-4, 0}, {2.0e-4, 2}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const compile_options_t options = {
            .drive_range_v = {-100.0, 100.0}, .position_range_um = {-100.0, 100.0}, .delay_s = cases[i].delay_s};
        hyst_parameters_t parameters;
        compile_report_t report;
        hyst_compensator_t compensator;
        static hyst_compensator_state_t state;
        model_t model;
        double worst = 0.0;
        make_bank_model(&model, rate, 0.0, 0, weights, NULL);
        compile_good(&model, &options, &parameters, &report, &compensator);
        TEST_ASSERT_EQUAL_UINT32(cases[i].lookahead, parameters.lookahead_samples);
        hyst_compensator_reset(&compensator, &state);
        for (int k = 0; k < 2000; k++) {
            const double wait = cases[i].lookahead - cases[i].delay_s * rate; /* samples */
            const double y = 80.0 * sin(2.0 * M_PI * f * k / rate);
            unsigned events;
            const hyst_q31_t drive = hyst_compensator_step(&compensator, &state, HYST_MODE_COMPENSATE,
                                                           position_from_micrometres(&parameters, y), &events);
            if (k > 500) { /* the first samples cross from rest */
                worst = fmax(worst,
                             fabs(drive_to_volts(&parameters, drive) - 80.0 * sin(2.0 * M_PI * f * (k - wait) / rate)));
            }
        }
        /* Linear interpolation halfway between two samples of this sine is low by (pi f / rate)^2 / 2 = 1.2e-4. */
        TEST_ASSERT_TRUE(worst < 80.0 * 1.3e-4);
        model_free(&model);
    }
}

static void test_refuses_in_plain_words(void) {
    const double falling[] = {1.0, -0.999}, plain[] = {1.0, 0.5}, threshold = 9.0;
    const compile_options_t good = {.drive_range_v = {-10.0, 10.0}, .position_range_um = {-20.0, 20.0}};
    compile_options_t options = {0};
    model_t model;
    make_bank_model(&model, 10000.0, 0.0, 1, plain, &threshold);
    expect_refusal(&model, &options, "does not say its drive_range_v: give --drive-range");
    options = good;
    options.drive_range_v[1] = 9999.0;
    expect_refusal(&model, &options, "--drive-range -10:9999 is beyond what an image can carry");
    options = good;
    options.delay_s = -2e-4;
    expect_refusal(&model, &options, "a delay of -0.0002 s: the amplifier can wait for one sample at most");
    options = good;
    options.position_range_um[0] = 15.0;
    expect_refusal(&model, &options, "block prandtl_ishlinskii: the position at the middle of the drive range");
    options = good;
    options.position_range_um[0] = -0.5;
    options.position_range_um[1] = 0.5;
    expect_refusal(&model, &options, "block prandtl_ishlinskii: a weight = 20 does not fit");
    options.position_range_um[0] = -3.0;
    options.position_range_um[1] = 3.0;
    expect_refusal(&model, &options, "the weights add up to 5 position ranges a drive range, the amplifier takes 4");
    model_set(model_append(&model, &block_rate_dependent_hysteresis), "beta_s", 1.0);
    expect_refusal(&model, &good, "block rate_dependent_hysteresis: beta in samples = 10000 does not fit");
    model_set(&model.block[1], "beta_s", 0.001);
    expect_refusal(&model, &good, hyst_field_text(HYST_FIELD_PI_BETA));
    model_set(&model.block[1], "beta_s", 0.0);
    for (int i = 0; i < HYST_IIR_MAX_SECTIONS + 1; i++) {
        model_set(model_append(&model, &block_resonance), "frequency_hz", 900.0);
        model_set(&model.block[model.blocks - 1], "damping_ratio", 0.1);
    }
    expect_refusal(&model, &good, "block resonance: the amplifier has no more than 4 sections");
    model_free(&model);
    make_bank_model(&model, 10000.0, 0.0, 1, falling, &threshold);
    expect_refusal(&model, &good, "compiled image: refused");
    model_free(&model);
    model_create(&model, 10000.0);
    model_set(model_append(&model, &block_transport_delay), "delay_s", 0.01);
    model_set_array(model_append(&model, &block_prandtl_ishlinskii), "weights", 1, plain, NULL);
    expect_refusal(&model, &good, "a delay of 0.01 s is 100 samples");
    model_free(&model);
}

/* The same model at a rate at which its worst sample fits the period of the boards' processor, and at one at which it
 * does not: an image all the same, with a note that names both numbers. */
static void test_an_image_for_which_there_is_no_time_has_a_note(void) {
    const double weights[] = {1.0, 0.1}, thresholds[] = {10.0}, rates_hz[] = {10000.0, 200000.0};
    const compile_options_t ranges = {.drive_range_v = {-100.0, 100.0}, .position_range_um = {-150.0, 150.0}};
    for (size_t i = 0; i < 2; i++) {
        hyst_parameters_t parameters;
        compile_report_t report;
        failure_t failure = {{0}};
        model_t model;
        compile_options_t options = ranges;
        options.sample_rate_hz = rates_hz[i];
        make_bank_model(&model, 10000.0, 0.0, 1, weights, thresholds);
        TEST_ASSERT_TRUE_MESSAGE(compile_model(&model, &options, &parameters, &report, &failure), failure.text);
        const char *note = report.notes > 0 ? report.note[report.notes - 1] : "";
        const bool refused = strstr(note, "refuses this: a sample takes up to 2102 cycles, a period at 200000 Hz has "
                                          "279") != NULL; /* 2 * (835 + 200 + 16), 840 - 537 - 24 */
        TEST_ASSERT_EQUAL_MESSAGE(i == 1, refused, note);
        model_free(&model);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_fixed_point_forward_model_is_the_double_one);
    RUN_TEST(test_rate_dependent_fixed_point_is_the_double_one);
    RUN_TEST(test_creep_in_fixed_point_is_the_double_one);
    RUN_TEST(test_dielectric_loss_takes_the_creep_cells);
    RUN_TEST(test_asymmetry_in_fixed_point_is_the_double_one);
    RUN_TEST(test_linear_line_is_the_middle_of_the_major_loop);
    RUN_TEST(test_ranges_default_to_the_recordings_widened);
    RUN_TEST(test_inverse_of_a_mode_and_a_lag);
    RUN_TEST(test_inverse_of_two_modes);
    RUN_TEST(test_a_measured_delay_is_looked_ahead_over);
    RUN_TEST(test_no_filters_only_looks_ahead);
    RUN_TEST(test_what_is_undone_has_a_note);
    RUN_TEST(test_an_image_for_which_there_is_no_time_has_a_note);
    RUN_TEST(test_refuses_in_plain_words);
    return UNITY_END();
}
