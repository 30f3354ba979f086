/* SPDX-License-Identifier: MIT */
/*
 * Bounds used below. Table elements are Q28 and lie in (0, 2^31), the differences of neighbours in (0, 2^31 / N]
 * (hyst_preisach_build). The offset is below 1 in magnitude, so the outputs at the ends of the range, offset -+ E / 2,
 * are below 5, and since all branches rise every output lies between them: below 5 * 2^60 in Q60.
 */
#include "hyst/preisach.h"
#include "hyst/reciprocal.h"

static hyst_preisach_status_t check_step(uint32_t intervals, int64_t difference, hyst_preisach_status_t too_flat) {
    /* Slope = difference / (2 / N). |difference| < 2^32, N <= 30. */
    const int64_t slope = difference * intervals;
    if (slope < 2 * (int64_t)HYST_PREISACH_MIN_SLOPE) {
        return too_flat;
    }
    return slope > 2 * HYST_PREISACH_MAX_SLOPE ? HYST_PREISACH_TOO_STEEP : HYST_PREISACH_OK;
}

hyst_preisach_status_t hyst_preisach_build(hyst_preisach_t *model, uint32_t intervals, hyst_q31_t offset,
                                           const hyst_q28_t everett[], uint32_t *element) {
    *element = 0;
    if (intervals == 0 || intervals > HYST_PREISACH_MAX_INTERVALS) {
        return HYST_PREISACH_INTERVALS_OUT_OF_RANGE;
    }
    uint32_t at = 0;
    for (uint32_t i = 1; i <= intervals; i++) {
        for (uint32_t j = 0; j < i; j++, at++) {
            /* E(i-1,j) stands i-1 elements earlier, E(i,j+1) one later; next to the diagonal both are E(k,k) = 0. */
            const bool diagonal = j + 1U == i;
            const int64_t below = diagonal ? 0 : everett[at + 1U - i];
            const int64_t beside = diagonal ? 0 : everett[at + 1U];
            hyst_preisach_status_t status = check_step(intervals, everett[at] - below, HYST_PREISACH_RISING_TOO_FLAT);
            if (status == HYST_PREISACH_OK) {
                status = check_step(intervals, everett[at] - beside, HYST_PREISACH_FALLING_TOO_FLAT);
            }
            if (status != HYST_PREISACH_OK) {
                *element = at;
                return status;
            }
        }
    }
    model->intervals = intervals;
    model->offset = offset;
    at = 0;
    for (uint32_t i = 0; i <= intervals; i++) {
        model->everett[i][i] = 0;
        for (uint32_t j = 0; j < i; j++, at++) {
            model->everett[i][j] = everett[at];
            model->everett[j][i] = -everett[at];
        }
    }
    return HYST_PREISACH_OK;
}

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

int64_t hyst_preisach_everett(const hyst_preisach_t *model, hyst_q31_t to, hyst_q31_t from) {
    return to >= from ? everett(model, to, from) : -everett(model, from, to);
}

static hyst_preisach_point_t on_branch(const hyst_preisach_t *model, const hyst_preisach_point_t *start,
                                       hyst_q31_t drive) {
    /* An output: below 5 * 2^60. Both terms are below 2^63. */
    return (hyst_preisach_point_t){.drive = drive,
                                   .output = start->output + hyst_preisach_everett(model, drive, start->drive)};
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

_Static_assert(HYST_PREISACH_MAX_EXTREMES % 2 == 0, "a full stack ends with a maximum");

/*
 * In a stack that has become full, the last k >= 1 with the smallest gap: the distance in drive of reversal k from the
 * next of the same kind, k + 2, which lies further in. Minima (even) rise inwards, maxima sink. The lower end stays:
 * its gap is enclosed by reversals 1 and 2 from the other side, and counts as that of 1. Noted when the stack becomes
 * full, because the sample that needs it has enough to do (merge).
 */
static HYST_APART void note_gaps(hyst_preisach_state_t *state) {
    const hyst_preisach_point_t *point = &state->extreme[2];
    uint32_t minimum = (uint32_t)point[0].drive;
    uint32_t maximum = (uint32_t)point[1].drive;
    const uint32_t first = minimum - (uint32_t)state->extreme[0].drive;
    const uint32_t second = (uint32_t)state->extreme[1].drive - maximum;
    uint32_t least = first < second ? first : second;
    uint32_t smallest = 1;
    for (uint32_t k = 2; k + 2U < HYST_PREISACH_MAX_EXTREMES; k += 2U, point += 2) {
        const uint32_t next_minimum = (uint32_t)point[2].drive;
        const uint32_t rise = next_minimum - minimum;
        if (rise <= least) {
            least = rise;
            smallest = k;
        }
        const uint32_t next_maximum = (uint32_t)point[3].drive;
        const uint32_t fall = maximum - next_maximum;
        if (fall <= least) {
            least = fall;
            smallest = k + 1U;
        }
        minimum = next_minimum;
        maximum = next_maximum;
    }
    state->smallest = smallest;
    state->least = least;
}

/* Behind the last minimum stands the present drive, and that gap is the last one. */
static uint32_t smallest_gap(const hyst_preisach_state_t *state) {
    const uint32_t last = HYST_PREISACH_MAX_EXTREMES - 2U;
    const uint32_t rise = (uint32_t)state->now.drive - (uint32_t)state->extreme[last].drive;
    return rise <= state->least ? last : state->smallest;
}

/* The points from `next` to before `end` take the place of the two before them, their outputs moved by `change`. */
static inline void close_up(hyst_preisach_point_t *next, const hyst_preisach_point_t *end, int64_t change) {
    for (; next < end; next++) {
        next[-2].drive = next->drive;
        next[-2].output = next->output + change;
    }
}

/*
 * Makes room in a full stack by forgetting two neighbouring reversals, k and k + 1, where the gap between k and k + 2
 * is the smallest. There are 63 gaps and they add up to at most the range, so it is at most 2^32 / 63. All outputs
 * further in move by the same number: the weight of the rectangle of the Preisach plane that changes hands.
 */
static void merge(const hyst_preisach_t *model, hyst_preisach_state_t *state) {
    hyst_preisach_point_t *const end = &state->extreme[HYST_PREISACH_MAX_EXTREMES];
    hyst_preisach_point_t *const next = &state->extreme[smallest_gap(state) + 2U];
    const hyst_preisach_point_t *inner = next < end ? next : &state->now;
    const int64_t change = on_branch(model, next - 3, inner->drive).output - inner->output;
    close_up(next, end, change);
    state->now.output += change;
    state->extremes = HYST_PREISACH_MAX_EXTREMES - 2U;
}

/* The present point becomes a reversal. */
static inline void turn(hyst_preisach_state_t *state) {
    state->extreme[state->extremes] = state->now;
    state->extremes++; /* <= HYST_PREISACH_MAX_EXTREMES: merge() makes room, a reset has 30 */
    if (state->extremes == HYST_PREISACH_MAX_EXTREMES) {
        note_gaps(state);
    }
}

HYST_APART void hyst_preisach_advance(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive) {
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
    state->smallest = state->least = 0; /* not full yet */
}

void hyst_preisach_reset(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive) {
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
    hyst_preisach_advance(model, state, drive);
}

hyst_q31_t hyst_preisach_output(const hyst_preisach_t *model, const hyst_preisach_state_t *state) {
    (void)model;                                                   /* as without endy other hysteresis */
    return hyst_saturate(hyst_round_shift(state->now.output, 29)); /* < 5 * 2^60 + 2^28 */
}

/* x / divisor, x < 2^39, divisor <= 2 HYST_PREISACH_MAX_INTERVALS: by two divisions of 32 bits. */
static inline uint64_t divide_by_small(uint64_t x, uint32_t divisor) {
    const uint32_t upper = (uint32_t)(x >> 16);                                        /* < 2^23 */
    const uint32_t rest = (upper % divisor) << 16 | (uint32_t)(x & (uint64_t)0xFFFFU); /* < 60 * 2^16 */
    return (uint64_t)(upper / divisor) << 16 | rest / divisor;                         /* the latter < 2^16 */
}

HYST_APART hyst_q31_t hyst_preisach_solve(const hyst_preisach_t *model, const hyst_preisach_state_t *state,
                                          hyst_q31_t position, bool *saturated) {
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
    const uint64_t place =
        ((uint64_t)interval << 33) + hyst_fraction((uint64_t)(wanted - lower), (uint64_t)(upper - lower));
    const int64_t drive = HYST_Q31_MIN + (int64_t)divide_by_small(place + model->intervals, 2U * model->intervals);
    if (drive > HYST_Q31_MAX) {
        *saturated = true;
    }
    return hyst_saturate(drive);
}

hyst_q31_t hyst_preisach_forward(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t drive) {
    hyst_preisach_advance(model, state, drive);
    return hyst_preisach_output(model, state);
}

hyst_q31_t hyst_preisach_inverse(const hyst_preisach_t *model, hyst_preisach_state_t *state, hyst_q31_t position,
                                 bool *saturated) {
    const hyst_q31_t drive = hyst_preisach_solve(model, state, position, saturated);
    hyst_preisach_advance(model, state, drive);
    return drive;
}

/*
 * How many reversals are carried. One sample since the last call has put one on top of the stack, or taken some off:
 * then what was carried is what it was. Or it merged, from some reversal on: each of them is now another one, that lies
 * further in, and so bisection finds the first. Those behind it are the old ones moved up by two.
 */
static uint32_t still_carried(const hyst_preisach_state_t *from, const hyst_preisach_t *to,
                              hyst_preisach_state_t *to_state, uint32_t carried) {
    const hyst_preisach_point_t *now = from->extreme;
    hyst_preisach_point_t *then = to_state->extreme;
    const uint32_t most = carried < from->extremes ? carried : from->extremes;
    if (now[most - 1U].drive == then[most - 1U].drive) {
        return most;
    }
    uint32_t first = 1; /* the lower end stays */
    for (uint32_t end = most - 1U; first < end;) {
        const uint32_t middle = first + (end - first) / 2U;
        if (now[middle].drive == then[middle].drive) {
            first = middle + 1U;
        } else {
            end = middle;
        }
    }
    if (carried <= first + 2U) {
        return first;
    }
    hyst_preisach_point_t *next = &then[first + 2U];
    close_up(next, &then[carried], on_branch(to, &then[first - 1U], next->drive).output - next->output);
    return carried - 2U;
}

bool hyst_preisach_carry(const hyst_preisach_t *from, const hyst_preisach_state_t *from_state,
                         const hyst_preisach_t *to, hyst_preisach_state_t *to_state, uint32_t *carried) {
    (void)from; /* reversals are drives: read without their model */
    if (*carried == 0) {
        begin(to, to_state);
    }
    uint32_t k = *carried > 0 ? still_carried(from_state, to, to_state, *carried) : 1U;
    const uint32_t extremes = from_state->extremes;
    const uint32_t portion_end =
        k + HYST_PREISACH_CARRY_EXTREMES < extremes ? k + HYST_PREISACH_CARRY_EXTREMES : extremes;
    for (; k < portion_end; k++) {
        to_state->extreme[k] = on_branch(to, &to_state->extreme[k - 1U], from_state->extreme[k].drive);
    }
    *carried = k;
    if (k < extremes) {
        return false;
    }
    to_state->extremes = extremes;
    to_state->smallest = from_state->smallest; /* where it is full, so is the other, and gaps are drives */
    to_state->least = from_state->least;
    to_state->now = on_branch(to, &to_state->extreme[extremes - 1U], from_state->now.drive);
    return true;
}
