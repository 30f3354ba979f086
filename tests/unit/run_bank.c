/* SPDX-License-Identifier: MIT */
/*
 * Bounds used below. hyst_pi_build enforces sum |w_i| <= 4, that is 2^30 in Q28; hence |w_i| <= 2^30 and 2^20 <= S_j <=
 * 2^30. Signals are below 2^31 in magnitude, so products are below 2^61 and the whole weighted sum is too: W = sum w_i
 * z_i, |W| <= 2^61 (Q59).
 */
#include "run_bank.h"

run_bank_t run_bank_of(const hyst_pi_t *model) {
    run_bank_t bank = {.operators = model->operators,
                       .offset = model->offset,
                       .kappa_limit = model->kappa_limit,
                       .beta = model->beta,
                       .rate_gain = model->rate_gain};
    bank.slope[0] = model->slope[0].value;
    for (uint32_t i = 0; i < model->operators; i++) {
        bank.slope[i + 1] = model->slope[i + 1].value;
        bank.threshold[i] = model->threshold[i];
        bank.moment[i + 1] = bank.moment[i] + hyst_product(bank.slope[i + 1] - bank.slope[i], model->threshold[i]);
    }
    return bank;
}

/* Common growth of all thresholds, known before the sample. threshold + kappa <= HYST_Q31_MAX by kappa_limit. */
static hyst_q31_t kappa(const run_bank_t *model, const run_bank_state_t *state) {
    /* beta |v|: Q20 * Q30 = Q50, <= 2^62; 19 bits down is Q31. */
    const int64_t growth = hyst_round_shift((int64_t)model->beta * hyst_magnitude(state->rate), 19);
    return growth < model->kappa_limit ? (hyst_q31_t)growth : model->kappa_limit;
}

/* First operator of run k: where the next inner one ends. */
static uint32_t first_of(const run_bank_state_t *state, uint32_t k) {
    return k + 1U < state->runs ? state->run[k + 1U].end : 0U;
}

/* Sum of w_i z_i over the operators of the run from index `from` on: level * (<= 2^30) <= 2^62, moments <= 2^61. */
static int64_t run_sum(const run_bank_t *model, const run_bank_run_t *run, uint32_t from) {
    return run->level * (model->slope[run->end] - model->slope[from]) +
           run->side * (model->moment[run->end] - model->moment[from]);
}

/* W = sum of all w_i z_i. */
static int64_t memory_sum(const run_bank_t *model, const run_bank_state_t *state) {
    if (state->runs == 0) {
        return 0;
    }
    const run_bank_run_t *innermost = &state->run[state->runs - 1U];
    return innermost->outer + run_sum(model, innermost, 0);
}

/*
 * Where the drive, going outward (+1 up, -1 down), begins to carry operator i of the run along: z_i + outward a_i. The
 * threshold's common growth comes on top. |corner| < 2^32.
 */
static int64_t corner_of(const run_bank_t *model, const run_bank_run_t *run, uint32_t i, int outward) {
    return run->level + (int64_t)(run->side + outward) * model->threshold[i];
}

static void push(run_bank_state_t *state, int64_t level, int64_t outer, uint32_t end, int side) {
    state->run[state->runs] =
        (run_bank_run_t){.level = level, .outer = outer, .end = (uint16_t)end, .side = (int8_t)side};
    state->runs++; /* <= operators: every run has at least one */
}

/*
 * A movement outward or a search for a position asks every operator the same question, from the innermost on: does it
 * reach you? The answers are yes up to some operator and no behind it (nesting). question_t is the question;
 * reach() bisects, first over runs, then within one, and returns the number of operators with yes. *run is the run of
 * the last of them (when there is one).
 */
typedef struct {
    const run_bank_t *model;
    const run_bank_state_t *state;
    int outward;
    hyst_q31_t growth;
    bool for_position; /* else for a drive */
    int64_t goal;      /* drive without the growth, or position in Q59; */
} question_t;

/* Response at the corner of operator i of run k, where the operators before it are carried along and the others rest.
 */
static int64_t response_at(const question_t *q, uint32_t k, uint32_t i, int64_t corner) {
    const run_bank_run_t *run = &q->state->run[k];
    /* Carried: sum over m < i of w_m (corner - outward a_m), and w_0 (corner + outward growth). True size < 2^62. */
    const hyst_q28_t carried = q->model->slope[i] - q->model->slope[0];
    const int64_t thresholds = q->outward * (q->model->moment[i] + hyst_product(q->growth, carried));
    const int64_t drive = corner + (int64_t)q->outward * q->growth;
    return q->model->slope[i] * drive - thresholds + run_sum(q->model, run, i) + run->outer;
}

static bool reaches(const question_t *q, uint32_t k, uint32_t i) {
    const int64_t corner = corner_of(q->model, &q->state->run[k], i, q->outward);
    const int64_t there = q->for_position ? response_at(q, k, i, corner) : corner;
    return q->outward > 0 ? q->goal > there : q->goal < there;
}

static uint32_t reach(const question_t *q, uint32_t *run) {
    const uint32_t runs = q->state->runs;
    if (runs == 0 || !reaches(q, runs - 1U, 0)) {
        return 0;
    }
    uint32_t yes = runs - 1U; /* its first operator is reached */
    uint32_t no = 0;          /* runs outside `no` are not; yes >= no */
    while (yes > no) {
        const uint32_t middle = no + (yes - no) / 2U;
        if (reaches(q, middle, first_of(q->state, middle))) {
            yes = middle;
        } else {
            no = middle + 1U;
        }
    }
    *run = yes;
    uint32_t reached = first_of(q->state, yes) + 1U;
    uint32_t end = q->state->run[yes].end;
    while (reached < end) {
        const uint32_t middle = reached + (end - reached) / 2U;
        if (reaches(q, yes, middle)) {
            reached = middle + 1U;
        } else {
            end = middle;
        }
    }
    return reached;
}

/* Carries along all operators that the drive reaches going outward. */
static void move(const run_bank_t *model, run_bank_state_t *state, hyst_q31_t growth, hyst_q31_t drive, int outward) {
    const int64_t edge = drive - (int64_t)outward * growth; /* carried operators: z_i = edge - outward a_i */
    const question_t question = {
        .model = model, .state = state, .outward = outward, .growth = growth, .for_position = false, .goal = edge};
    uint32_t run = 0;
    const uint32_t moved = reach(&question, &run);
    if (moved == 0) {
        return;
    }
    const run_bank_run_t *last = &state->run[run];
    const int64_t outer = last->outer + run_sum(model, last, moved); /* of a run that is wiped out: outer + 0 */
    state->runs = moved == last->end ? run : run + 1U;
    push(state, edge, outer, moved, -outward);
}

void run_bank_reset(const run_bank_t *model, run_bank_state_t *state, hyst_q31_t drive) {
    state->runs = 0;
    if (model->operators > 0) {
        push(state, 0, 0, model->operators, 0);
    }
    move(model, state, 0, drive, drive < 0 ? -1 : 1);
    state->drive = drive;
    state->rate = 0;
}

void run_bank_advance(const run_bank_t *model, run_bank_state_t *state, hyst_q31_t drive) {
    const hyst_q31_t growth = kappa(model, state);
    /* At most one of the two finds anything. Not only the sign of the step decides: thresholds may also have shrunk. */
    move(model, state, growth, drive, 1);
    move(model, state, growth, drive, -1);
    if (model->beta > 0) {
        /* Step in Q30, |step| <= 2^31 - 1/2: fits. The new rate lies between the old one and the step, so it fits too.
         */
        const int64_t step = ((int64_t)drive - state->drive) >> 1;
        /* |step - rate| < 2^32, times g <= 2^30: below 2^62. The change alone may need 33 bits, so it is added in 64.
         */
        state->rate = (hyst_q30_t)(state->rate + hyst_round_shift((step - state->rate) * model->rate_gain, 30));
    }
    state->drive = drive;
}

hyst_q31_t run_bank_memory(const run_bank_t *model, const run_bank_state_t *state, uint32_t index) {
    uint32_t k = state->runs - 1U;
    while (state->run[k].end <= index) {
        k--;
    }
    return (hyst_q31_t)(state->run[k].level + (int64_t)state->run[k].side * model->threshold[index]);
}

hyst_q31_t run_bank_output(const run_bank_t *model, const run_bank_state_t *state) {
    /* |w_0 u + W| <= 2^61 together, offset < 2^59 in Q59. */
    const int64_t sum = hyst_product(model->slope[0], state->drive) + memory_sum(model, state);
    return hyst_saturate(hyst_round_shift(sum + hyst_product(model->offset, HYST_Q28_ONE), 28));
}

/* The drive outside the gap of the first operator, on the side `outward`; |result| may exceed the range. */
static int64_t solve_outward(const question_t *q, int64_t from_memory) {
    uint32_t k = 0;
    const uint32_t passed = reach(q, &k);
    if (passed == 0) {
        /* Inside the gap. w_0 = S_0 > 0 and |goal - W| < 2^62. C divides toward zero: half a divisor away from zero
         * first. */
        const int64_t distance = q->goal - from_memory;
        const int64_t half = distance < 0 ? -(q->model->slope[0] / 2) : q->model->slope[0] / 2;
        return (distance + half) / q->model->slope[0];
    }
    /* Behind the corner of the last operator passed the slope is S_passed. */
    const int64_t corner = corner_of(q->model, &q->state->run[k], passed - 1U, q->outward);
    const uint64_t rest = (uint64_t)hyst_magnitude(q->goal - response_at(q, k, passed - 1U, corner));
    const uint64_t slope = (uint64_t)q->model->slope[passed];
    return corner + q->outward * (q->growth + (int64_t)((rest + slope / 2U) / slope));
}

hyst_q31_t run_bank_solve(const run_bank_t *model, const run_bank_state_t *state, hyst_q31_t position,
                          bool *saturated) {
    /* |position - offset| < 2^32: |goal| < 2^60. */
    const int64_t goal = ((int64_t)position - model->offset) * HYST_Q28_ONE;
    const int64_t from_memory = memory_sum(model, state);
    const hyst_q31_t centre = state->runs > 0 ? run_bank_memory(model, state, 0) : 0;
    const question_t question = {.model = model,
                                 .state = state,
                                 .outward = goal >= hyst_product(model->slope[0], centre) + from_memory ? 1 : -1,
                                 .growth = kappa(model, state),
                                 .for_position = true,
                                 .goal = goal};
    const int64_t drive = solve_outward(&question, from_memory);
    if (drive > HYST_Q31_MAX || drive < HYST_Q31_MIN) {
        *saturated = true;
    }
    return hyst_saturate(drive);
}

/* A straight piece of the memory curve: memory = level + side * threshold. */
typedef struct {
    int64_t level;
    int side;
} line_t;

static int64_t on_line(line_t line, int64_t threshold) {
    return line.level + line.side * threshold;
}

/* Number of operators whose threshold is at most `threshold`, among the first `high`: often all of them. */
static uint32_t operators_up_to(const run_bank_t *model, int64_t threshold, uint32_t high) {
    uint32_t low = high > 0 && model->threshold[high - 1U] <= threshold ? high : 0U;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2U;
        if (model->threshold[middle] <= threshold) {
            low = middle + 1U;
        } else {
            high = middle;
        }
    }
    return low;
}

/*
 * The first `end` operators lie on this line. Runs that are left without operators vanish: one, or all that were laid
 * after what has turned out to be outdated (run_bank_carry).
 */
static void lay(const run_bank_t *model, run_bank_state_t *state, uint32_t end, line_t line) {
    while (state->runs > 0 && state->run[state->runs - 1U].end <= end) {
        state->runs--; /* from at most HYST_PI_MAX_OPERATORS */
    }
    int64_t outer = 0;
    if (state->runs > 0) {
        const run_bank_run_t *previous = &state->run[state->runs - 1U];
        if (end > 0 && previous->side == line.side && previous->level == line.level) {
            return; /* a line that goes on is the same run */
        }
        outer = previous->outer + run_sum(model, previous, end);
    }
    if (end > 0) {
        push(state, line.level, outer, end, line.side);
    }
}

/*
 * Inwards of the known point (threshold, memory) the curve is `line`, as far as it may be: a curve of slope at most 1
 * through the point stays between the lines of slope -1 and +1 through it. Where `line` would leave these bounds, the
 * bound takes its place.
 */
static void lay_inwards_of(const run_bank_t *model, run_bank_state_t *state, int64_t threshold, int64_t memory,
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

static line_t line_of(const run_bank_run_t *run) {
    return (line_t){run->level, run->side};
}

/* The outermost run, and what lies outside of it. There the memory keeps the last operator's value, as far as a play
 * can be displaced: |z| + a <= 1. */
static void lay_outermost(const run_bank_t *from, const run_bank_run_t *outermost, const run_bank_t *to,
                          run_bank_state_t *to_state) {
    const hyst_q31_t last = from->threshold[from->operators - 1U];
    const int64_t memory = on_line(line_of(outermost), last);
    const line_t constant = {memory, 0};
    const line_t farthest = memory >= 0 ? (line_t){HYST_Q31_MAX, -1} : (line_t){HYST_Q31_MIN, 1};
    const int64_t meets = memory >= 0 ? HYST_Q31_MAX - memory : memory - HYST_Q31_MIN;
    to_state->runs = 0;
    lay(to, to_state, to->operators, farthest);
    lay(to, to_state, operators_up_to(to, meets, to->operators), constant);
    lay(to, to_state, operators_up_to(to, last, to->operators), line_of(outermost));
}

/* Run k >= 1, inwards of the last known point of the run around it. */
static void lay_run(const run_bank_t *from, const run_bank_run_t run[], uint32_t k, const run_bank_t *to,
                    run_bank_state_t *to_state) {
    const hyst_q31_t next = from->threshold[run[k].end];
    lay_inwards_of(to, to_state, next, on_line(line_of(&run[k - 1U]), next), line_of(&run[k]));
}

bool run_bank_carry(const run_bank_t *from, const run_bank_state_t *from_state, const run_bank_t *to,
                    run_bank_state_t *to_state, uint32_t *carried) {
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
        lay_inwards_of(to, to_state, first, on_line(line_of(&from_state->run[runs - 1U]), first), at_drive);
    }
    to_state->drive = from_state->drive;
    to_state->rate = to->beta > 0 ? from_state->rate : 0;
    return true;
}
