/* SPDX-License-Identifier: MIT */
/* The memory of a play bank, carried over to another one. Bounds as in prandtl_ishlinskii.c. */
#include "prandtl_ishlinskii_runs.h"

/* A straight piece of the memory curve: memory = level + side * threshold. */
typedef struct {
    int64_t level;
    int side;
} line_t;

static int64_t on_line(line_t line, hyst_q31_t threshold) {
    return line.level + hyst_product(line.side, threshold);
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

/*
 * Base (hyst_pi_base) of a run on `line` up to operator `end`, inside of one on `outer`, whose base is known. The bases
 * differ by what both lines give over these operators, w_0 u + sum of w_i z_i with the drive where the line begins:
 * S_end level + side M_end each, M_end = w_1 a_1 + ... = S_end a_end - T_end. Within 2^63 on the way, in 64 bits.
 */
static int64_t base_inside(const hyst_pi_t *model, uint32_t end, line_t line, line_t outer, int64_t outer_base) {
    const uint32_t slope = (uint32_t)model->slope[end].value;
    uint64_t base = (uint64_t)outer_base + (uint64_t)(line.level - outer.level) * slope;
    const int turns = line.side - outer.side;
    if (turns != 0) {
        const int64_t moment =
            hyst_product(model->slope[end].value, model->threshold[end - 1U]) - (model->turn[end - 1U] >> 1);
        base += (uint64_t)(turns * moment); /* |moment| <= 2^61 */
    }
    return (int64_t)base;
}

/*
 * The first `end` operators lie on this line. Where the innermost run begins is not worked out before all is laid
 * (begin_innermost); until then both responses hold its base, and so their mean. Runs that are left without operators
 * vanish: one, or all that were laid after what has turned out to be outdated (hyst_pi_carry).
 */
static void lay(const hyst_pi_t *model, hyst_pi_state_t *state, uint32_t end, line_t line) {
    while (state->runs > 0 && state->run[state->runs - 1U].end <= end) {
        state->runs--; /* from at most HYST_PI_MAX_OPERATORS */
    }
    if (end == 0) {
        return;
    }
    hyst_pi_run_t *run = &state->run[state->runs];
    line_t outer = {0, 0}; /* outside of all: nothing */
    int64_t outer_base = 0;
    if (state->runs > 0) {
        outer = line_in(model, run - 1);
        outer_base = hyst_pi_base(run - 1);
        hyst_pi_begin_at(model, run - 1, outer_base, end);
    }
    run->level = (hyst_q31_t)(uint32_t)line.level;
    run->side = (int8_t)line.side;
    run->end = (uint16_t)end;
    run->response[HYST_PI_DOWN] = run->response[HYST_PI_UP] = base_inside(model, end, line, outer, outer_base);
    state->runs++; /* <= operators: every run has at least one */
}

static void begin_innermost(const hyst_pi_t *model, hyst_pi_state_t *state) {
    if (state->runs > 0) {
        hyst_pi_run_t *innermost = &state->run[state->runs - 1U];
        hyst_pi_begin_at(model, innermost, hyst_pi_base(innermost), 0);
    }
}

/*
 * Inwards of the known point (threshold, memory) the curve is `line`, as far as it may be: a curve of slope at most 1
 * through the point stays between the lines of slope -1 and +1 through it. Where `line` would leave these bounds, the
 * bound takes its place.
 */
static void lay_inwards_of(const hyst_pi_t *model, hyst_pi_state_t *state, hyst_q31_t threshold, int64_t memory,
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
    const line_t line = line_in(from, outermost);
    const int64_t memory = on_line(line, last);
    const line_t constant = {memory, 0};
    const line_t farthest = memory >= 0 ? (line_t){HYST_Q31_MAX, -1} : (line_t){HYST_Q31_MIN, 1};
    const int64_t meets = memory >= 0 ? HYST_Q31_MAX - memory : memory - HYST_Q31_MIN;
    const uint32_t known = operators_up_to(to, last, to->operators);
    const uint32_t kept = operators_up_to(to, meets, to->operators);
    to_state->runs = 0;
    if (kept < to->operators) {
        lay(to, to_state, to->operators, farthest);
    }
    if (known < kept) {
        lay(to, to_state, kept, constant);
    }
    lay(to, to_state, known, line);
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
            begin_innermost(to, to_state); /* the next call goes on from there, or from a run that encloses it */
            return false;
        }
        /* The curve begins at the drive for threshold 0. */
        const hyst_q31_t first = from->threshold[0];
        lay_inwards_of(to, to_state, first, on_line(line_in(from, &from_state->run[runs - 1U]), first), at_drive);
    }
    begin_innermost(to, to_state);
    to_state->drive = from_state->drive;
    to_state->rate = to->beta > 0 ? from_state->rate : 0;
    to_state->growth = hyst_pi_growth(to, to_state->rate);
    return true;
}
