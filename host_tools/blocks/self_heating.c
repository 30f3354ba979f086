/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Losses warm the actuator while it is driven, and change its gain and its length:
 *
 *     position = (1 + gain_per_hz q) x + expansion_um_per_hz q,     time_constant_s dq/dt = p - q
 *
 * A loop of amplitude a loses as much as C tan(delta) a^2 for each period. So does a bank of plays with evenly spread
 * thresholds, all of one weight, that lose as they slide: p is what they slide in a second, 1 Hz for one loop a second
 * over the range of the drive. It needs no centre, and a loop within another one counts by its own amplitude.
 */
#include "chain/catalogue.h"
#include "chain/parameter_rows.h"
#include <math.h>

enum { GAIN, EXPANSION, TIME_CONSTANT, HALF_RANGE };
enum { PLAYS = 16 };

static const parameter_info_t parameters[] = {
    {.name = "gain_per_hz",
     .proportional = true,
     .unit = "1/Hz",
     .low = -1e3,
     .high = 1e3,
     .text = "change of the gain, as a part of it, by lasting loops over the range, one a second"},
    {.name = "expansion_um_per_hz",
     .proportional = true,
     .unit = "um/Hz",
     .low = -1e6,
     .high = 1e6,
     .text = "change of the position by such loops"},
    {.name = "time_constant_s", .unit = "s", .low = 1e-3, .high = 1e9, .text = "in which all but 1/e has warmed"},
    PARAMETER_HALF_RANGE("half_range_v", "V", "drive_range_v", "half of the range of the drive that such loops have")};

typedef struct {
    double gain_per_hz, expansion_um_per_hz;
    double spacing_v;     /* between thresholds */
    double hz_per_v;      /* p of one volt that one play slides within a sample */
    double part;          /* of the way from q to p that a sample takes */
    double play_v[PLAYS]; /* where they are */
    double heat_hz;       /* q */
} state_t;

static void open(void *memory, const parameter_t *parameter, const stage_setup_t *setup) {
    state_t *state = memory;
    const double half_range_v = parameter[HALF_RANGE].value[0];
    state->gain_per_hz = parameter[GAIN].value[0];
    state->expansion_um_per_hz = parameter[EXPANSION].value[0];
    state->spacing_v = half_range_v / PLAYS;
    /* In a loop over the range they slide 4 (half_range_v - threshold), two ranges in the mean. */
    state->hz_per_v = setup->sample_rate_hz / (2.0 * half_range_v * PLAYS);
    state->part = -expm1(-1.0 / (parameter[TIME_CONSTANT].value[0] * setup->sample_rate_hz));
}

/* Moves the plays; how far, all together. */
static double slide(state_t *state, double drive_v) {
    double slid_v = 0.0;
    for (int i = 0; i < PLAYS; i++) {
        const double threshold_v = ((double)i + 0.5) * state->spacing_v, before_v = state->play_v[i];
        state->play_v[i] = fmax(drive_v - threshold_v, fmin(before_v, drive_v + threshold_v));
        slid_v += fabs(state->play_v[i] - before_v);
    }
    return slid_v;
}

static void settle(void *memory, signal_t *signal) {
    state_t *state = memory;
    for (int i = 0; i < PLAYS; i++) {
        state->play_v[i] = signal->drive_v;
    }
    state->heat_hz = 0.0;
}

static void step(void *memory, signal_t *signal) {
    state_t *state = memory;
    const double power_hz = state->hz_per_v * slide(state, signal->drive_v);
    state->heat_hz += state->part * (power_hz - state->heat_hz);
    signal->value += state->heat_hz * (state->gain_per_hz * signal->value + state->expansion_um_per_hz);
}

/* First the gain, then the length, at several time constants. The size is a thousandth, were the drive as fast all the
 * time as it is at its fastest. */
static bool probe(const probe_setting_t *setting, size_t index, double *value) {
    enum { TIMES = 4 };
    double center_v;
    probe_range(setting->drive_low_v, setting->drive_high_v, &center_v, &value[HALF_RANGE]);
    const double fastest_hz = fmax(setting->largest_rate_v_per_s / (4.0 * value[HALF_RANGE]), 1e-9);
    const double stroke_um = setting->displacement_high_um - setting->displacement_low_um;
    value[GAIN] = index % 2 == 0 ? 1e-3 / fastest_hz : 0.0;
    value[EXPANSION] = index % 2 == 1 ? 1e-3 * stroke_um / fastest_hz : 0.0;
    return probe_between(setting->longest_s, 0.02 * setting->longest_s, TIMES, index / 2, &value[TIME_CONSTANT]);
}

static const probe_t looked_for = {
    .group = "slow",
    .in_place_of = {"slow"}, /* with two sizes it comes near whatever is slow */
    .explanation = "The actuator warms by its own losses: gain or position change while it is driven fast and far, and "
                   "come back at rest.",
    .excitation = "bursts, fast and large, with pauses in which it cools",
    .parts = PROBE_SILENCE | PROBE_BURST | PROBE_RETURN,
    .probe = probe,
    .searched = 1U << GAIN | 1U << EXPANSION | 1U << TIME_CONSTANT,
    .accuracy = {0.2, 0.2, 0.2}}; /* another simulator's losses: time constants came out 15 to 45 % long */

const block_t block_self_heating = {
    .name = "self_heating",
    .place = PLACE_SLOW,
    .order = 50,
    .text = "gain and length that follow the heat of the actuator's own losses",
    .follows_temperature = true,
    .parameter = parameters,
    .parameters = 4,
    .state_bytes = sizeof(state_t),
    .open = open,
    .settle = settle,
    .step = step,
    .uncorrected = "the amplifier does not know how warm the actuator is, and the position moves with it",
    .probe = &looked_for};
