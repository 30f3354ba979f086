/* SPDX-License-Identifier: MIT */
/* The memory of a play bank, carried over to another one. Bounds as in prandtl_ishlinskii.c. */
#include "prandtl_ishlinskii_runs.h"

/* A straight piece of the memory curve: memory = level + side * threshold. A memory fits, so 32 bits with wrap-around
 * lead there although the level may need 33. */
typedef struct {
    uint32_t level;
    int side;
} line_t;

static inline hyst_q31_t on_line(line_t line, hyst_q31_t threshold) {
    return (hyst_q31_t)(line.level + (uint32_t)line.side * (uint32_t)threshold);
}

static inline line_t line_of(const hyst_pi_run_t *run) {
    return (line_t){(uint32_t)run->level, run->side};
}

/* Number of operators whose threshold is at most `threshold`, which is below the largest number: that is what searches
 * are filled up with. */
static inline uint32_t operators_up_to(const hyst_pi_t *model, uint32_t threshold) {
    return threshold < (uint32_t)model->threshold[0] ? 0 : hyst_pi_last_within(model, threshold) + 1U;
}

/*
 * The first `end` operators lie on the line. Where the innermost run begins is not worked out before all is laid
 * (begin_innermost); until then both responses hold its base, and so their mean. A line that goes on is the same run.
 *
 * Its base (hyst_pi_base) and that of the run around it differ by what both lines give over these operators, w_0 u +
 * sum of w_i z_i with the drive where the line begins: S_end level + side M_end each, M_end = w_1 a_1 + ... = S_end
 * a_end - T_end. So it is S_end times how far the lines are apart at a_end, less T_end for each side that they differ
 * by. The sum is within 2^63, and on the way it may wrap around.
 */
static HYST_APART void lay(const hyst_pi_t *model, hyst_pi_state_t *state, uint32_t end, uint32_t level, int side) {
    uint32_t runs = state->runs;
    /* Runs without operators vanish: one, or all that were laid after what has turned out to be outdated
     * (hyst_pi_carry). At most HYST_PI_MAX_OPERATORS. */
    while (runs > 0 && state->run[runs - 1U].end <= end) {
        runs--;
    }
    state->runs = runs;
    if (end == 0) {
        return;
    }
    hyst_pi_run_t *run = &state->run[runs];
    uint64_t base = 0;
    int turns = side;
    if (runs > 0) { /* else outside of it is nothing */
        const line_t outer = line_of(run - 1);
        if (outer.side == side && outer.level == level) {
            return;
        }
        /* That run could go on so far in, and so its line is a memory here, too. */
        const hyst_q31_t memory = on_line(outer, model->threshold[end - 1U]);
        base =
            (uint64_t)hyst_pi_begin_at(model, run - 1, end) + (uint64_t)hyst_product(-model->slope[end].value, memory);
        turns -= outer.side;
    }
    base += (uint64_t)hyst_product(model->slope[end].value, on_line((line_t){level, side}, model->threshold[end - 1U]));
    base -= (uint64_t)(turns * (model->turn[end - 1U] >> 1)); /* 2 T, even */
    run->level = (hyst_q31_t)level;
    run->side = (int8_t)side;
    run->end = (uint16_t)end;
    run->response[HYST_PI_DOWN] = run->response[HYST_PI_UP] = (int64_t)base;
    state->runs = runs + 1U; /* <= operators: every run has at least one */
}

static void begin_innermost(const hyst_pi_t *model, hyst_pi_state_t *state) {
    if (state->runs > 0) {
        (void)hyst_pi_begin_at(model, &state->run[state->runs - 1U], 0);
    }
}

/*
 * Inwards of the known point (threshold, memory) the curve is a line, as far as it may be: a curve of slope at most 1
 * through the point stays between the lines of slope -1 and +1 through it. Where the line would leave these bounds, the
 * bound takes its place: up to how far in they meet, `back`, rounded up.
 */

/* How many operators are inwards of where they meet. */
static inline uint32_t operators_on_it(const hyst_pi_t *model, hyst_q31_t threshold, uint32_t back) {
    const uint32_t known = (uint32_t)threshold;
    return back < known ? operators_up_to(model, known - (back > 0 ? back : 1U)) : 0;
}

/* The level of the bound, of slope `side`, through this point. */
static inline uint32_t level_of_bound(hyst_q31_t threshold, hyst_q31_t memory, int side) {
    return (uint32_t)memory - (uint32_t)side * (uint32_t)threshold;
}

/* The outermost run, and what lies outside of it. There the memory keeps the last operator's value, as far as a play
 * can be displaced: |z| + a <= 1. */
static void lay_outermost(const hyst_pi_t *from, const hyst_pi_run_t *outermost, const hyst_pi_t *to,
                          hyst_pi_state_t *to_state) {
    const hyst_q31_t last = from->threshold[from->operators - 1U];
    const hyst_q31_t memory = on_line(line_of(outermost), last);
    const uint32_t operators = to->operators;
    uint32_t known = operators;
    to_state->runs = 0;
    if (operators > 0 && last < to->threshold[operators - 1U]) {
        const uint32_t meets = memory >= 0 ? (uint32_t)(HYST_Q31_MAX - memory) : (uint32_t)(memory - HYST_Q31_MIN);
        const uint32_t kept = meets < (uint32_t)to->threshold[operators - 1U] ? operators_up_to(to, meets) : operators;
        known = operators_up_to(to, (uint32_t)last);
        if (kept < operators) {
            lay(to, to_state, operators, (uint32_t)(memory >= 0 ? HYST_Q31_MAX : HYST_Q31_MIN), memory >= 0 ? -1 : 1);
        }
        if (known < kept) {
            lay(to, to_state, kept, (uint32_t)memory, 0);
        }
    }
    lay(to, to_state, known, (uint32_t)outermost->level, outermost->side);
}

/* Run k >= 1, inwards of the last known point of the run around it. Both memories are less apart than the thresholds:
 * nesting. So a line that is not level leaves the point on its own side. */
static void lay_run(const hyst_pi_t *from, const hyst_pi_run_t *run, const hyst_pi_t *to, hyst_pi_state_t *to_state) {
    const hyst_q31_t *next = &from->threshold[run->end];
    const line_t line = line_of(run);
    const hyst_q31_t memory = on_line(line_of(run - 1), next[0]);
    const int32_t rise = (int32_t)((uint32_t)on_line(line, next[-1]) - (uint32_t)memory);
    const int above = line.side != 0 ? line.side : rise > 0 ? 1 : -1;
    uint32_t back = (uint32_t)above * (uint32_t)rise;
    if (line.side != 0) { /* they approach by two for each one further in */
        back += (uint32_t)next[0] - (uint32_t)next[-1];
        back = (back >> 1) + (back & 1U);
    }
    const uint32_t inside = operators_up_to(to, (uint32_t)next[0] - 1U);
    const uint32_t on_it = operators_on_it(to, next[0], back);
    if (on_it < inside) {
        lay(to, to_state, inside, level_of_bound(next[0], memory, -above), -above);
    }
    lay(to, to_state, on_it, line.level, line.side);
}

/* The curve begins at the drive for threshold 0. The bound is the innermost run's line most often. */
static void lay_drive(const hyst_pi_t *from, const hyst_pi_run_t *innermost, hyst_q31_t drive, const hyst_pi_t *to,
                      hyst_pi_state_t *to_state) {
    const hyst_q31_t first = from->threshold[0];
    const hyst_q31_t memory = on_line(line_of(innermost), first);
    const int above = drive > memory ? 1 : -1;
    const uint32_t back = (uint32_t)above * ((uint32_t)drive - (uint32_t)memory);
    const uint32_t on_it = operators_on_it(to, first, back);
    const uint32_t bound = level_of_bound(first, memory, -above);
    const hyst_pi_run_t *behind = to_state->run + to_state->runs;
    if (to_state->runs == 0 || behind[-1].side != -above || (uint32_t)behind[-1].level != bound) {
        const uint32_t inside = operators_up_to(to, (uint32_t)first - 1U);
        if (on_it < inside) {
            lay(to, to_state, inside, bound, -above);
        }
    }
    lay(to, to_state, on_it, (uint32_t)drive, 0);
}

_Static_assert(HYST_PI_CARRY_RUNS == 1, "a call takes one run over");

HYST_APART bool hyst_pi_carry(const hyst_pi_t *from, const hyst_pi_state_t *from_state, const hyst_pi_t *to,
                              hyst_pi_state_t *to_state, uint32_t *carried) {
    const uint32_t runs = from_state->runs;
    if (runs == 0) {
        to_state->runs = 0;
        lay(to, to_state, to->operators, (uint32_t)from_state->drive, 0);
    } else {
        /* A sample takes runs off the inner end and puts one there: all but the innermost are what they were. */
        const uint32_t k = *carried < runs ? *carried : runs - 1U;
        if (k == 0) {
            lay_outermost(from, &from_state->run[0], to, to_state);
        } else {
            lay_run(from, &from_state->run[k], to, to_state);
        }
        *carried = k + 1U;
        if (k + 1U < runs) {
            return false;
        }
        lay_drive(from, &from_state->run[runs - 1U], from_state->drive, to, to_state);
    }
    begin_innermost(to, to_state);
    to_state->drive = from_state->drive;
    to_state->rate = to->beta > 0 ? from_state->rate : 0;
    to_state->growth = hyst_pi_growth(to, to_state->rate);
    return true;
}
