/* SPDX-License-Identifier: MIT */
/* Bounds as in lib/hyst/src/preisach.c. */
#include "preisach_plain.h"

/* Where a drive stands on the grid: exactly. */
typedef struct {
    uint32_t interval; /* 0..N-1 */
    uint32_t fraction; /* of the interval, Q32 */
} place_t;

static place_t place_of(const hyst_preisach_t *model, hyst_q31_t drive) {
    /* Distance from the lower end, in [0, 2^32), times N: 37 bits, of which the upper 5 count intervals. */
    const uint64_t distance = (uint64_t)((int64_t)drive - HYST_Q31_MIN) * model->intervals;
    return (place_t){.interval = (uint32_t)(distance >> 32), .fraction = (uint32_t)distance};
}

/* E(level i, from), Q60, exact: linear in `from` between two levels. A mean of two elements, so below 2^63. */
static int64_t at_level(const hyst_preisach_t *model, uint32_t i, place_t from) {
    const int64_t left = model->everett[i][from.interval];
    const int64_t right = model->everett[i][from.interval + 1U];
    return left * ((int64_t)1 << 32) + (right - left) * (int64_t)from.fraction;
}

/* floor(x * fraction / 2^32); |x| < 2^63. */
static int64_t part_of(int64_t x, uint32_t fraction) {
    /* |x >> 32| <= 2^31, so the first product is at most 2^63 - 2^31 in magnitude; the second term is below 2^32. */
    return (x >> 32) * (int64_t)fraction + (int64_t)(((uint64_t)(uint32_t)x * fraction) >> 32);
}

/*
 * E(high, low) for high >= low. One order of interpolation for both directions, so that a loop closes to the last bit.
 * Next to a level the two values differ by the slope at most: 4 * 2 / N * 2^60.
 */
static int64_t everett(const hyst_preisach_t *model, hyst_q31_t high, hyst_q31_t low) {
    const place_t to = place_of(model, high);
    const place_t from = place_of(model, low);
    const int64_t left = at_level(model, to.interval, from);
    const int64_t right = at_level(model, to.interval + 1U, from);
    return left + part_of(right - left, to.fraction);
}

static int64_t preisach_plain_everett(const hyst_preisach_t *model, hyst_q31_t to, hyst_q31_t from) {
    return to >= from ? everett(model, to, from) : -everett(model, from, to);
}

static hyst_preisach_point_t on_branch(const hyst_preisach_t *model, const hyst_preisach_point_t *start,
                                       hyst_q31_t drive) {
    /* An output: below 5 * 2^60. Both terms are below 2^63. */
    return (hyst_preisach_point_t){.drive = drive,
                                   .output = start->output + preisach_plain_everett(model, drive, start->drive)};
}

/* What a movement aims at: a drive or an output. */
typedef struct {
    bool output;
    int64_t value;
} goal_t;

/*
 * Number of stacked reversals that are left when the goal is reached, the start of the branch it lies on included: one
 * more than there are, if that branch has its start at the present point. Maxima stand at odd indices, minima at even
 * ones; a rise forgets the maxima it reaches together with the minima after them. The maxima sink inwards and the
 * minima rise, in drive and output alike, so bisection finds the last one that is reached. At most 6 probes: 32 of a
 * kind.
 */
static uint32_t remaining(const hyst_preisach_state_t *state, goal_t goal, bool rise) {
    const uint32_t first = rise ? 1U : 0U;
    uint32_t low = 0;
    uint32_t high = (state->extremes + 1U - first) / 2U; /* of this kind */
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2U;
        const hyst_preisach_point_t *extreme = &state->extreme[2U * middle + first];
        const int64_t there = goal.output ? extreme->output : extreme->drive;
        if (rise ? goal.value >= there : goal.value <= there) {
            high = middle;
        } else {
            low = middle + 1U;
        }
    }
    /* A fall that reaches the lower end leaves that end, where the next rise begins. */
    const uint32_t left = 2U * low + first;
    return left > 0 ? left : 1U;
}

/* Distance in drive of reversal k from the next of the same kind, which lies further in. */
static uint32_t gap(const hyst_preisach_state_t *state, uint32_t k) {
    const uint32_t outer = (uint32_t)state->extreme[k].drive;
    const uint32_t inner = (uint32_t)(k + 2U < state->extremes ? state->extreme[k + 2U].drive : state->now.drive);
    return k % 2U == 0U ? inner - outer : outer - inner; /* minima rise inwards, maxima sink */
}

/*
 * Makes room in a full stack by forgetting two neighbouring reversals, k and k + 1, where the gap between k and k + 2
 * is the smallest. There are 63 gaps and they add up to at most the range, so it is at most 2^32 / 63. All outputs
 * further in move by the same number: the weight of the rectangle of the Preisach plane that changes hands.
 */
static void merge(const hyst_preisach_t *model, hyst_preisach_state_t *state) {
    uint32_t smallest = 1;
    /* The lower end stays: its gap is enclosed by reversals 1 and 2 from the other side. */
    uint32_t least = gap(state, 0) < gap(state, 1) ? gap(state, 0) : gap(state, 1);
    for (uint32_t k = 2; k + 1U < state->extremes; k++) {
        const uint32_t here = gap(state, k);
        if (here <= least) {
            least = here;
            smallest = k;
        }
    }
    const uint32_t next = smallest + 2U;
    hyst_preisach_point_t *inner = next < state->extremes ? &state->extreme[next] : &state->now;
    const int64_t change = on_branch(model, &state->extreme[smallest - 1U], inner->drive).output - inner->output;
    for (uint32_t k = next; k < state->extremes; k++) {
        state->extreme[k - 2U] = state->extreme[k];
        state->extreme[k - 2U].output += change;
    }
    state->now.output += change;
    state->extremes -= 2U;
}

/* The present point becomes a reversal. */
static void turn(hyst_preisach_state_t *state) {
    state->extreme[state->extremes] = state->now;
    state->extremes++; /* <= HYST_PREISACH_MAX_EXTREMES: merge() makes room, a reset has 30 */
}

void preisach_plain_advance(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive) {
    if (drive == state->now.drive) {
        return;
    }
    const uint32_t left = remaining(state, (goal_t){.output = false, .value = drive}, drive > state->now.drive);
    if (left <= state->extremes) {
        state->extremes = left;
    } else {
        if (state->extremes == HYST_PREISACH_MAX_EXTREMES) {
            merge(model, state);
        }
        turn(state);
    }
    state->now = on_branch(model, &state->extreme[state->extremes - 1U], drive);
}

/* All relays down: the lower end of the range. */
static void begin(const hyst_preisach_t *model, hyst_preisach_state_t *state) {
    /* E over the whole range is below 2^31 in Q28; half of it in Q60 is E * 2^31. */
    const int64_t half = model->everett[model->intervals][0] * ((int64_t)1 << 31);
    state->extremes = 1;
    state->extreme[0] =
        (hyst_preisach_point_t){.drive = HYST_Q31_MIN, .output = model->offset * ((int64_t)1 << 29) - half};
    state->now = state->extreme[0];
}

void preisach_plain_reset(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive) {
    const int64_t range = (int64_t)1 << 32;
    begin(model, state);
    for (uint32_t k = 0; 2U * k < model->intervals; k++) {
        const int64_t inset = range * k / model->intervals; /* level k, and the same from above */
        if (k > 0) {
            turn(state);
            state->now = on_branch(model, &state->extreme[state->extremes - 1U], (hyst_q31_t)(HYST_Q31_MIN + inset));
            turn(state);
        }
        state->now = on_branch(model, &state->extreme[state->extremes - 1U], (hyst_q31_t)(HYST_Q31_MAX - inset));
    }
    preisach_plain_advance(model, state, drive);
}

hyst_q31_t preisach_plain_output(const hyst_preisach_t *model, const hyst_preisach_state_t *state) {
    (void)model;                                                   /* as without endy other hysteresis */
    return hyst_saturate(hyst_round_shift(state->now.output, 29)); /* < 5 * 2^60 + 2^28 */
}

/* floor(2^33 rest / whole), 33 bits; 0 <= rest < whole < 2^62. */
static uint64_t quotient(uint64_t rest, uint64_t whole) {
    uint64_t bits = 0;
    for (unsigned k = 0; k < 33; k++) {
        rest *= 2U;
        bits *= 2U;
        if (rest >= whole) {
            rest -= whole;
            bits += 1U;
        }
    }
    return bits;
}

hyst_q31_t preisach_plain_solve(const hyst_preisach_t *model, const hyst_preisach_state_t *state, hyst_q31_t position,
                                bool *saturated) {
    const int64_t goal = position * ((int64_t)1 << 29); /* Q60, <= 2^60 in magnitude */
    const uint32_t left = remaining(state, (goal_t){.output = true, .value = goal}, goal > state->now.output);
    const hyst_preisach_point_t *start = left <= state->extremes ? &state->extreme[left - 1U] : &state->now;
    const place_t from = place_of(model, start->drive);
    const int64_t wanted = goal - start->output; /* < 6 * 2^60 */
    /* E(level i, start) rises with i. Last interval whose lower level is not above the goal; at most 5 probes. */
    uint32_t interval = 0;
    uint32_t end = model->intervals;
    while (interval + 1U < end) {
        const uint32_t middle = interval + (end - interval) / 2U;
        if (wanted >= at_level(model, middle, from)) {
            interval = middle;
        } else {
            end = middle;
        }
    }
    const int64_t lower = at_level(model, interval, from);
    const int64_t upper = at_level(model, interval + 1U, from);
    if (wanted < lower || wanted >= upper) {
        *saturated = true;
        return wanted < lower ? HYST_Q31_MIN : HYST_Q31_MAX;
    }
    /* Place on the grid in Q33, rounded down, below 2^38; to the nearest drive: half a divisor more. */
    const uint64_t place = ((uint64_t)interval << 33) + quotient((uint64_t)(wanted - lower), (uint64_t)(upper - lower));
    const int64_t drive = HYST_Q31_MIN + (int64_t)((place + model->intervals) / (2U * model->intervals));
    if (drive > HYST_Q31_MAX) {
        *saturated = true;
    }
    return hyst_saturate(drive);
}
