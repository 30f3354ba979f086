/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/chain.h"
#include "ellipses_003.h"
#include "numbers.h"
#include "numerics/ellipse_fit.h"
#include "numerics/golden_section.h"
#include "numerics/least_squares.h"
#include "printed_004.h"
#include "twins/twin_001.h"
#include "twins/twin_003.h"
#include "twins/twin_004.h"
#include <gsl/gsl_math.h>
#include <stdlib.h>

bool numbers_add(json_t *numbers, const char *question, const number_t *list, size_t count, failure_t *failure) {
    json_t *object = json_object();
    bool good = json_object_set_new(numbers, question, object) == 0;
    for (size_t i = 0; good && i < count; i++) {
        good = json_object_set_new(object, list[i].name, json_real(list[i].value)) == 0;
    }
    return good || fail(failure, "a number of %s is none", question);
}

/* y = intercept + slope x by least squares. */
static bool fit_line(const double *x, const double *y, size_t count, double *intercept, double *slope,
                     failure_t *failure) {
    static const double free_of_bounds[2] = {-HUGE_VAL, -HUGE_VAL};
    normal_equations_t equations;
    double found[2] = {0.0, 0.0};
    normal_equations_create(&equations, 2);
    for (size_t i = 0; i < count; i++) {
        normal_equations_add(&equations, (double[]){1.0, x[i]}, y[i]);
    }
    normal_equations_finish(&equations);
    const bool good = solve_bounded(&equations, free_of_bounds, found, NULL, failure);
    normal_equations_free(&equations);
    *intercept = found[0];
    *slope = found[1];
    return good;
}

/* The lag of the ellipses is intercept + 2 pi f delay; their gain falls with the logarithm of the frequency. */
static bool numbers_003(json_t *numbers, failure_t *failure) {
    enum { UP_TO_200_HZ = ELLIPSES_003 - 1 };
    double omega[ELLIPSES_003], decade[ELLIPSES_003], lag[ELLIPSES_003], gain[ELLIPSES_003], height[ELLIPSES_003];
    double lag0, delay_s, gain0, fall, worst = 0.0, off_trend = 0.0;
    for (size_t i = 0; i < ELLIPSES_003; i++) {
        const ellipse_003_t *row = &ellipses_003[i];
        const ellipse_t ellipse = {row->x_center * TWIN_003_DRIVE_V, row->y_center * TWIN_003_RANGE_UM, row->major,
                                   row->minor, row->angle};
        const ellipse_sines_t sines = ellipse_sines(&ellipse);
        omega[i] = 2.0 * M_PI * row->frequency_hz;
        decade[i] = log10(row->frequency_hz);
        lag[i] = sines.lag;
        gain[i] = sines.y_radius * TWIN_003_RANGE_UM / (sines.x_radius * TWIN_003_DRIVE_V);
        height[i] = 2.0 * sines.y_radius * TWIN_003_RANGE_UM;
    }
    if (!fit_line(omega, lag, ELLIPSES_003, &lag0, &delay_s, failure) ||
        !fit_line(decade, gain, UP_TO_200_HZ, &gain0, &fall, failure)) {
        return false;
    }
    for (size_t i = 0; i < ELLIPSES_003; i++) {
        worst = fmax(worst, fabs(lag[i] - lag0 - delay_s * omega[i]));
        off_trend = i < UP_TO_200_HZ ? fmax(off_trend, fabs(gain[i] / (gain0 + fall * decade[i]) - 1.0)) : off_trend;
    }
    const double last = omega[ELLIPSES_003 - 1];
    const double rise = gain[ELLIPSES_003 - 1] / (gain0 + fall * decade[ELLIPSES_003 - 1]) - 1.0;
    const number_t list[] = {{"delay_ms", 1e3 * delay_s},
                             {"lag_at_rest_rad", lag0},
                             {"lag_worst_rad", worst},
                             {"delay_part_percent", 100.0 * delay_s * last / lag[ELLIPSES_003 - 1]},
                             {"low_pass_loss_percent", 100.0 * (1.0 - 1.0 / hypot(1.0, delay_s * last))},
                             {"gain_half_hz", gain[0]},
                             {"gain_200hz", gain[ELLIPSES_003 - 2]},
                             {"gain_300hz", gain[ELLIPSES_003 - 1]},
                             {"gain_fall_percent_per_decade", -100.0 * fall / gain0},
                             {"rise_300hz_percent", 100.0 * rise},
                             {"off_trend_percent", 100.0 * off_trend},
                             {"height_200hz_um", height[ELLIPSES_003 - 2]},
                             {"height_300hz_um", height[ELLIPSES_003 - 1]}};
    return numbers_add(numbers, "003", list, sizeof list / sizeof list[0], failure);
}

/* Strokes and frequencies as printed. */
static bool numbers_000(json_t *numbers, failure_t *failure) {
    const double kept_40v = 9.454 / 10.12, kept_80v = 13.81 / 21.57, hz = 200.0;
    /* The voltage that gives 13.81 um at 10 Hz, between the two that are printed. */
    const double reached_v = 40.0 + 40.0 * (13.81 - 10.12) / (21.57 - 10.12);
    const number_t list[] = {
        {"loss_40v_percent", 100.0 * (1.0 - kept_40v)},
        {"loss_80v_percent", 100.0 * (1.0 - kept_80v)},
        {"cutoff_hz", hz / sqrt(1.0 / (kept_40v * kept_40v) - 1.0)},
        {"limit_kv_per_s", 1e-3 * 2.0 * hz * reached_v}, /* of a triangle of that height */
        {"onset_kv_per_s", 1e-3 * M_PI * 80.0 * 125.0},  /* the same for 40 V and 250 Hz */
    };
    return numbers_add(numbers, "000", list, sizeof list / sizeof list[0], failure);
}

/* Undamped magnification of a mode at 75 Hz, the third harmonic of 25 Hz and the fifth of 15 Hz. */
static double magnification(double hz) {
    return 1.0 / fabs(1.0 - gsl_pow_2(hz / 75.0));
}

static bool numbers_001(json_t *numbers, failure_t *failure) {
    const double strain_third = 0.01 * magnification(35.0) / magnification(105.0); /* "less than 1/100" at 35 Hz */
    const double quality = sqrt(1.0 / 8.0) * magnification(25.0) / strain_third;   /* "1/8" of the power at 25 Hz */
    const double lag_80hz = atan2(80.0 / 75.0 / quality, 1.0 - gsl_pow_2(80.0 / 75.0));
    const number_t list[] = {{"third_in_strain_percent", 100.0 * strain_third},
                             {"third_at_25hz_percent", 100.0 * sqrt(1.0 / 8.0)},
                             {"quality", quality},
                             {"lag_80hz_deg", lag_80hz * 180.0 / M_PI}};
    return numbers_add(numbers, "001", list, sizeof list / sizeof list[0], failure);
}

static bool miss_width(void *context, double delay_s, double *value) {
    (void)context;
    *value = fabs(printed_004_width(200.0, (printed_004_rate_t){.delay_s = delay_s}) - 17.5);
    return true;
}

double numbers_004_delay_s(void) {
    double delay_s;
    golden_section(miss_width, NULL, 0.0, 1e-3, 30, &delay_s);
    return delay_s;
}

/* What the host tool's blocks with the printed numbers leave of the printed model's loop at 200 Hz. */
static bool miss_of_blocks(double *nrmse_percent, failure_t *failure) {
    recording_t loop;
    model_t model;
    printed_004_record(&loop, 200.0, (printed_004_rate_t){.beta_s = printed_004_beta_s}, 0.1, 1);
    printed_004_model(&model, 0.0);
    double *simulated = allocate(loop.samples, sizeof *simulated);
    const size_t half = loop.samples / 2; /* the chain begins at rest, the loop does not */
    const bool good = chain_simulate(&model, &loop, 1, simulated, failure);
    if (good) {
        *nrmse_percent = measure_error(loop.column[COLUMN_DISPLACEMENT] + half, simulated + half, half).nrmse_percent;
    }
    free(simulated);
    model_free(&model);
    recording_free(&loop);
    return good;
}

static bool numbers_004(json_t *numbers, failure_t *failure) {
    double miss_percent = 0.0;
    if (!miss_of_blocks(&miss_percent, failure)) {
        return false;
    }
    const printed_004_rate_t printed = {.beta_s = printed_004_beta_s}, delayed = {.delay_s = numbers_004_delay_s()};
    const number_t list[] = {{"beta_ms", 1e3 * printed_004_beta_s},
                             {"delay_ms", 1e3 * delayed.delay_s},
                             {"hold_ms", 0.5e3 / TWIN_004_RATE_HZ},
                             {"sensor_ms", 1e3 / (2.0 * M_PI * 1000.0)},
                             {"blocks_miss_percent", miss_percent},
                             {"width_10hz_um", printed_004_width(10.0, printed)},
                             {"width_50hz_um", printed_004_width(50.0, printed)},
                             {"width_100hz_um", printed_004_width(100.0, printed)},
                             {"width_200hz_um", printed_004_width(200.0, printed)},
                             {"delayed_10hz_um", printed_004_width(10.0, delayed)},
                             {"delayed_50hz_um", printed_004_width(50.0, delayed)},
                             {"delayed_100hz_um", printed_004_width(100.0, delayed)},
                             {"delayed_200hz_um", printed_004_width(200.0, delayed)}};
    return numbers_add(numbers, "004", list, sizeof list / sizeof list[0], failure);
}

bool numbers_printed(json_t *numbers, failure_t *failure) {
    return numbers_003(numbers, failure) && numbers_000(numbers, failure) && numbers_001(numbers, failure) &&
           numbers_004(numbers, failure);
}
