/* SPDX-License-Identifier: MIT */
/* The memory of a play bank, carried over to another one. Bounds as in prandtl_ishlinskii.c. */
#include "prandtl_ishlinskii_runs.h"

/* A straight piece of the memory curve: memory = level + side * threshold. */
typedef struct {
    int64_t level;
    int side;
} line_t;

static int64_t on_line(line_t line, int64_t threshold) {
    return line.level + line.side * threshold;
}

/* Number of operators whose threshold is at most `threshold`, among the first `high`: often all of them. */
static inline uint32_t operators_up_to(const hyst_pi_t *model, int64_t threshold, uint32_t high) {
    if (high == 0 || threshold < model->threshold[0]) {
        return 0;
    }
    if (threshold >= model->threshold[high - 1U]) {
        return high;
    }
    return hyst_pi_last_within(model, (uint32_t)threshold) + 1U; /* within Q31, and below the last one */
}

/* The line of a run: through its last operator. */
static line_t line_in(const hyst_pi_t *model, const hyst_pi_run_t *run) {
    const uint32_t last = run->end - 1U;
    return (line_t){hyst_pi_memory_in(model, run, last) - (int64_t)run->side * model->threshold[last], run->side};
}

/* w_0 u + sum of w_i z_i over the first `end` operators, where these lie on the line and the drive is where it begins.
 * |level| < 2^32, S_j <= 2^30: within 2^62, and the sum of w_i a_i within 2^61. */
static int64_t up_to(const hyst_pi_t *model, uint32_t end, line_t line) {
    const int64_t straight = line.level * model->slope[end];
    if (end == 0 || line.side == 0) {
        return straight;
    }
    const int64_t moment = hyst_product(model->slope[end], model->threshold[end - 1U]) - model->turn[end - 1U] / 2;
    return straight + line.side * moment;
}

/*
 * The first `end` operators lie on this line. Runs that are left without operators vanish: one, or all that were laid
 * after what has turned out to be outdated (hyst_pi_carry).
 */
static void lay(const hyst_pi_t *model, hyst_pi_state_t *state, uint32_t end, line_t line) {
    while (state->runs > 0 && state->run[state->runs - 1U].end <= end) {
        state->runs--; /* from at most HYST_PI_MAX_OPERATORS */
    }
    int64_t outer = 0; /* sum of w_i z_i over the operators outside, <= 2^61 in magnitude */
    if (state->runs > 0) {
        hyst_pi_run_t *previous = &state->run[state->runs - 1U];
        const int64_t base = hyst_pi_base(previous);
        outer = base - up_to(model, end, line_in(model, previous));
        if (end > 0) {
            hyst_pi_begin_at(model, previous, base, end);
        }
    }
    if (end > 0) {
        hyst_pi_run_t *run = &state->run[state->runs];
        run->level = (hyst_q31_t)(uint32_t)line.level;
        run->side = (int8_t)line.side;
        run->end = (uint16_t)end;
        hyst_pi_begin_at(model, run, outer + up_to(model, end, line), 0);
        state->runs++; /* <= operators: every run has at least one */
    }
}

/*
 * Inwards of the known point (threshold, memory) the curve is `line`, as far as it may be: a curve of slope at most 1
 * through the point stays between the lines of slope -1 and +1 through it. Where `line` would leave these bounds, the
 * bound takes its place.
 */
static void lay_inwards_of(const hyst_pi_t *model, hyst_pi_state_t *state, int64_t threshold, int64_t memory,
                           line_t line) {
    const line_t highest = {memory + threshold, -1};
    const line_t lowest = {memory - threshold, 1};
    const line_t bound = on_line(line, threshold) > memory ? highest : lowest;
    /* The line is within bounds up to the threshold where it meets the bound; parallel to it, everywhere or nowhere. */
    const int64_t slope = line.side - bound.side;
    const int64_t distance = bound.level - line.level;
    int64_t meets = threshold;
    if (slope > 0) {
        meets = distance >> (slope - 1); /* rounded down: slope is 1 or 2 */
    } else if (slope < 0) {
        meets = -distance >> (-slope - 1);
    }
    const uint32_t inside = operators_up_to(model, threshold - 1, model->operators);
    const uint32_t on_it = operators_up_to(model, meets, inside);
    if (on_it < inside) {
        lay(model, state, inside, bound);
    }
    lay(model, state, on_it, line);
}

/* The outermost run, and what lies outside of it. There the memory keeps the last operator's value, as far as a play
 * can be displaced: |z| + a <= 1. */
static void lay_outermost(const hyst_pi_t *from, const hyst_pi_run_t *outermost, const hyst_pi_t *to,
                          hyst_pi_state_t *to_state) {
    const hyst_q31_t last = from->threshold[from->operators - 1U];
    const int64_t memory = on_line(line_in(from, outermost), last);
    const line_t constant = {memory, 0};
    const line_t farthest = memory >= 0 ? (line_t){HYST_Q31_MAX, -1} : (line_t){HYST_Q31_MIN, 1};
    const int64_t meets = memory >= 0 ? HYST_Q31_MAX - memory : memory - HYST_Q31_MIN;
    to_state->runs = 0;
    lay(to, to_state, to->operators, farthest);
    lay(to, to_state, operators_up_to(to, meets, to->operators), constant);
    lay(to, to_state, operators_up_to(to, last, to->operators), line_in(from, outermost));
}

/* Run k >= 1, inwards of the last known point of the run around it. */
static void lay_run(const hyst_pi_t *from, const hyst_pi_run_t run[], uint32_t k, const hyst_pi_t *to,
                    hyst_pi_state_t *to_state) {
    const hyst_q31_t next = from->threshold[run[k].end];
    lay_inwards_of(to, to_state, next, on_line(line_in(from, &run[k - 1U]), next), line_in(from, &run[k]));
}

bool hyst_pi_carry(const hyst_pi_t *from, const hyst_pi_state_t *from_state, const hyst_pi_t *to,
                   hyst_pi_state_t *to_state, uint32_t *carried) {
    const uint32_t runs = from_state->runs;
    const line_t at_drive = {from_state->drive, 0};
    if (runs == 0) {
        to_state->runs = 0;
        lay(to, to_state, to->operators, at_drive);
    } else {
        /* A sample takes runs off the inner end and puts one there: all but the innermost are what they were. */
        uint32_t k = *carried < runs ? *carried : runs - 1U;
        const uint32_t portion_end = k + HYST_PI_CARRY_RUNS < runs ? k + HYST_PI_CARRY_RUNS : runs;
        for (; k < portion_end; k++) {
            if (k == 0) {
                lay_outermost(from, &from_state->run[0], to, to_state);
            } else {
                lay_run(from, from_state->run, k, to, to_state);
            }
        }
        *carried = k;
        if (k < runs) {
            return false;
        }
        /* The curve begins at the drive for threshold 0. */
        const hyst_q31_t first = from->threshold[0];
        lay_inwards_of(to, to_state, first, on_line(line_in(from, &from_state->run[runs - 1U]), first), at_drive);
    }
    to_state->drive = from_state->drive;
    to_state->rate = to->beta > 0 ? from_state->rate : 0;
    to_state->growth = hyst_pi_growth(to, to_state->rate);
    return true;
}
