/* SPDX-License-Identifier: MIT */
#include "hyst/compensator.h"
#include <stddef.h>

/* What the hysteresis' operators see of a drive. */
static hyst_q31_t curved(const hyst_compensator_t *c, hyst_q31_t drive) {
    return c->curved ? hyst_curve_apply(&c->drive_curve, drive) : drive;
}

void hyst_compensator_reset(const hyst_compensator_t *compensator, hyst_compensator_state_t *state) {
    state->memory_in_use = 0;
    state->carried = 0;
    hyst_hysteresis_state_t *memory = hyst_compensator_memory(state);
    hyst_hysteresis_reset(&compensator->hysteresis, memory, curved(compensator, compensator->drive_park));
    hyst_creep_settle(&compensator->creep, &state->creep, hyst_hysteresis_output(&compensator->hysteresis, memory));
    hyst_iir_reset(&state->shape);
    hyst_iir_reset(&state->inertia);
    hyst_iir_reset(&state->equalise);
    state->mode = HYST_MODE_PARK;
    state->drive = compensator->drive_park;
    state->events = 0;
    state->transition = (hyst_transition_t){.size = 0};
    state->adopted = false;
    state->settled = false;
    state->continues = false;
}

static unsigned stage_of_hysteresis(const hyst_hysteresis_t *hysteresis) {
    if (hysteresis->family != HYST_FAMILY_PRANDTL_ISHLINSKII) {
        return HYST_STAGE_OTHER_FAMILY;
    }
    return hyst_pi_is_line(&hysteresis->prandtl_ishlinskii) ? (unsigned)HYST_STAGE_LINE : 0U;
}

void hyst_compensator_prepare(hyst_compensator_t *c) {
    c->stages = (c->reference_curved ? (unsigned)HYST_STAGE_REFERENCE_CURVE : 0U) |
                (c->shape.sections > 0 ? (unsigned)HYST_STAGE_SHAPE : 0U) |
                (c->creep.cells > 0 ? (unsigned)HYST_STAGE_CREEP : 0U) |
                (c->curved ? (unsigned)HYST_STAGE_DRIVE_CURVE : 0U) |
                (c->inertia.sections > 0 ? (unsigned)HYST_STAGE_INERTIA : 0U) |
                (c->equalise.sections > 0 ? (unsigned)HYST_STAGE_EQUALISE : 0U) | stage_of_hysteresis(&c->hysteresis);
    c->cascades = c->shape.sections | c->inertia.sections << 8 | c->equalise.sections << 16;
    if (c->curved) {
        hyst_curve_invert(&c->drive_curve, &c->drive_curve_inverse);
    }
}

/* Drive of the hysteresis (before the electronics' inverse) and of the amplifier (after it). */
typedef struct {
    hyst_q31_t hysteresis;
    hyst_q31_t amplifier;
} stage_drive_t;

static inline stage_drive_t same(hyst_q31_t drive) {
    return (stage_drive_t){.hysteresis = drive, .amplifier = drive};
}

/* A cascade that is there. Its state starts settled where it does not belong to the present input. */
static HYST_WITHIN hyst_q31_t filter(const hyst_iir_t *iir, hyst_iir_state_t *state, bool settled, hyst_q31_t x,
                                     bool *saturated) {
    return settled ? hyst_iir_pass(x, iir, state, saturated) : hyst_iir_begin(iir, state, x, saturated);
}

/* The hysteresis' drive for a position. */
static HYST_WITHIN hyst_q31_t invert(const hyst_compensator_t *c, const hyst_hysteresis_state_t *memory,
                                     hyst_q31_t position, bool *unreachable, hyst_hysteresis_found_t *found,
                                     unsigned stages) {
    if ((stages & HYST_STAGE_LINE) != 0) {
        return hyst_pi_solve_line(&c->hysteresis.prandtl_ishlinskii, position, unreachable);
    }
    if ((stages & HYST_STAGE_OTHER_FAMILY) != 0) {
        return hyst_hysteresis_find(&c->hysteresis, memory, position, unreachable, found);
    }
    const hyst_q31_t drive = hyst_pi_find(&c->hysteresis.prandtl_ishlinskii, &memory->prandtl_ishlinskii, position,
                                          &found->prandtl_ishlinskii);
    *unreachable = found->prandtl_ishlinskii.unreachable;
    return drive;
}

/* Of `stages` those that there may be: a constant, or those of the chain. */
static HYST_WITHIN stage_drive_t compensate(const hyst_compensator_t *c, hyst_compensator_state_t *state,
                                            const hyst_hysteresis_state_t *memory, hyst_q31_t reference,
                                            hyst_hysteresis_found_t *found, unsigned stages, bool settled) {
    bool filter_saturated = false;
    bool unreachable = false;
    hyst_q31_t elastic = reference;
    if ((stages & HYST_STAGE_REFERENCE_CURVE) != 0) {
        elastic = hyst_curve_apply(&c->reference_curve, elastic);
    }
    if ((stages & HYST_STAGE_SHAPE) != 0) {
        elastic = filter(&c->shape, &state->shape, settled, elastic, &filter_saturated);
    }
    if ((stages & HYST_STAGE_CREEP) != 0) {
        /* |elastic - offset| < 2^32. Saturating makes it the farthest that the hysteresis could reach. */
        elastic = hyst_saturate(elastic - hyst_creep_offset(&c->creep, &state->creep));
    }
    stage_drive_t drive = same(invert(c, memory, elastic, &unreachable, found, stages));
    if ((stages & HYST_STAGE_DRIVE_CURVE) != 0) {
        drive = same(hyst_curve_solve_by(&c->drive_curve, &c->drive_curve_inverse, drive.hysteresis, &unreachable));
    }
    if ((stages & HYST_STAGE_INERTIA) != 0) {
        drive.amplifier =
            hyst_add(drive.amplifier, filter(&c->inertia, &state->inertia, settled, elastic, &filter_saturated));
    }
    if ((stages & HYST_STAGE_EQUALISE) != 0) {
        drive.amplifier = filter(&c->equalise, &state->equalise, settled, drive.amplifier, &filter_saturated);
    }
    state->events = (unreachable ? (unsigned)HYST_STEP_UNREACHABLE : 0U) |
                    (filter_saturated ? (unsigned)HYST_STEP_FILTER_SATURATED : 0U);
    return drive;
}

static inline hyst_q31_t without_model(const hyst_compensator_t *c, hyst_mode_t mode, hyst_q31_t reference) {
    if (mode == HYST_MODE_DIRECT) {
        return reference;
    }
    if (mode == HYST_MODE_LINEAR) {
        /* |gain * reference| <= 2^62, so the sum of its 34 bits and the offset is far from 2^63. */
        return hyst_saturate(hyst_round_shift(hyst_product(c->linear_gain, reference), 28) + c->linear_offset);
    }
    return c->drive_park;
}

static inline void shrink(hyst_transition_t *transition, hyst_q31_t step) {
    const uint32_t by = (uint32_t)step;
    transition->size = transition->size > by ? transition->size - by : 0;
}

/* drive + transition, within the limits; *met: it is not that sum. The sum may need 34 bits. But either it lies beyond
 * the limit that the transition leads to, or the way there fits 32 bits, and so does the sum. What is then left to ask
 * is the other limit. */
static inline hyst_q31_t limited(hyst_q31_t drive, hyst_transition_t transition, hyst_q31_t low, hyst_q31_t high,
                                 bool *met) {
    const uint32_t size = transition.size;
    *met = true;
    if (transition.falls) {
        if (drive < low || (uint32_t)drive - (uint32_t)low < size) {
            return low;
        }
        const hyst_q31_t sum = (hyst_q31_t)((uint32_t)drive - size);
        if (sum > high) {
            return high;
        }
        *met = false;
        return sum;
    }
    if (drive > high || (uint32_t)high - (uint32_t)drive < size) {
        return high;
    }
    const hyst_q31_t sum = (hyst_q31_t)((uint32_t)drive + size);
    if (sum < low) {
        return low;
    }
    *met = false;
    return sum;
}

/* The drive of this sample, and what hysteresis and creep remember of it. `found`: NULL without a model. */
static HYST_WITHIN hyst_q31_t apply(const hyst_compensator_t *c, hyst_compensator_state_t *state,
                                    hyst_hysteresis_state_t *memory, stage_drive_t stage, hyst_q31_t low,
                                    hyst_q31_t high, const hyst_hysteresis_found_t *found, unsigned stages) {
    const hyst_transition_t transition = state->transition;
    bool met;
    const hyst_q31_t drive = limited(stage.amplifier, transition, low, high, &met);
    if (met) {
        state->events |= (unsigned)HYST_STEP_DRIVE_LIMITED;
    }
    state->drive = drive;
    /* Inertia and equalise sections are spent on moving the mass and on the electronics: the hysteresis sees what was
     * there before them. Without any, it sees the drive. */
    hyst_q31_t seen = drive;
    if (stage.hysteresis != stage.amplifier) {
        seen = limited(stage.hysteresis, transition, low, high, &met);
    }
    if ((stages & HYST_STAGE_DRIVE_CURVE) != 0) {
        seen = hyst_curve_apply(&c->drive_curve, seen);
    }
    if ((stages & HYST_STAGE_LINE) != 0) {
        hyst_pi_follow_line(&memory->prandtl_ishlinskii, seen);
    } else if (found == NULL) {
        hyst_hysteresis_advance(&c->hysteresis, memory, seen);
    } else if ((stages & HYST_STAGE_OTHER_FAMILY) != 0) {
        hyst_hysteresis_follow(&c->hysteresis, memory, seen, found);
    } else {
        hyst_pi_follow(&c->hysteresis.prandtl_ishlinskii, &memory->prandtl_ishlinskii, seen,
                       &found->prandtl_ishlinskii);
    }
    if ((stages & HYST_STAGE_CREEP) != 0) {
        hyst_creep_advance(&c->creep, &state->creep, hyst_hysteresis_output(&c->hysteresis, memory));
    }
    return drive;
}

/* A sample that goes on as the one before it (`continues`). */
static HYST_WITHIN hyst_q31_t go_on(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_q31_t reference,
                                    hyst_q31_t low, hyst_q31_t high, unsigned stages) {
    hyst_hysteresis_state_t *const memory = hyst_compensator_memory(state);
    hyst_hysteresis_found_t found;
    const stage_drive_t stage = compensate(c, state, memory, reference, &found, stages, true);
    shrink(&state->transition, c->transition_slew);
    return apply(c, state, memory, stage, low, high, &found, stages);
}

/* Most chains have no other stages than filters: a copy of the step for these behind play operators, one for these
 * behind another family, one where there is no hysteresis at all, and one for the rest. All take what
 * hyst_compensator_step_within does, in its order. */
#define FILTERS ((unsigned)HYST_STAGE_SHAPE | (unsigned)HYST_STAGE_EQUALISE)
#define FAMILY  ((unsigned)HYST_STAGE_OTHER_FAMILY)
#define LINE    ((unsigned)HYST_STAGE_LINE)

/* The stages of the rest, and of samples that begin: none of them is the shorter for a straight line. */
static inline unsigned any_of(const hyst_compensator_t *c) {
    return c->stages & ~LINE;
}

static HYST_APART hyst_q31_t go_on_plays(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_mode_t mode,
                                         hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high) {
    (void)mode;
    return go_on(c, state, reference, low, high, c->stages & FILTERS);
}

static HYST_APART hyst_q31_t go_on_family(const hyst_compensator_t *c, hyst_compensator_state_t *state,
                                          hyst_mode_t mode, hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high) {
    (void)mode;
    return go_on(c, state, reference, low, high, (c->stages & FILTERS) | FAMILY);
}

static HYST_APART hyst_q31_t go_on_line(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_mode_t mode,
                                        hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high) {
    (void)mode;
    return go_on(c, state, reference, low, high, (c->stages & FILTERS) | LINE);
}

static HYST_APART hyst_q31_t go_on_any(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_mode_t mode,
                                       hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high) {
    (void)mode;
    return go_on(c, state, reference, low, high, any_of(c));
}

/* The transition of a sample that does not go on as the one before it, whose drive is to be this one. */
static inline void turn_to(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_mode_t mode,
                           hyst_q31_t drive) {
    if (mode != state->mode || state->adopted) {
        const bool falls = state->drive < drive;
        state->transition.falls = falls;
        state->transition.size =
            falls ? (uint32_t)drive - (uint32_t)state->drive : (uint32_t)state->drive - (uint32_t)drive;
    } else {
        shrink(&state->transition, c->transition_slew);
    }
    state->mode = mode;
    state->adopted = false;
}

/* The first sample with a model, or with new parameters. */
static HYST_WITHIN hyst_q31_t begin_with(const hyst_compensator_t *c, hyst_compensator_state_t *state,
                                         hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high, unsigned stages) {
    hyst_hysteresis_state_t *const memory = hyst_compensator_memory(state);
    hyst_hysteresis_found_t found;
    const stage_drive_t stage = compensate(c, state, memory, reference, &found, stages, state->settled);
    turn_to(c, state, HYST_MODE_COMPENSATE, stage.amplifier);
    state->settled = true;
    state->continues = true;
    return apply(c, state, memory, stage, low, high, &found, stages);
}

/* As before, a copy for play operators with filters alone. */
static HYST_APART hyst_q31_t begin(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_q31_t reference,
                                   hyst_q31_t low, hyst_q31_t high) {
    if ((c->stages & ~FILTERS) == 0) {
        return begin_with(c, state, reference, low, high, c->stages & FILTERS);
    }
    return begin_with(c, state, reference, low, high, any_of(c));
}

/* A sample without a model. */
static HYST_APART hyst_q31_t pass(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_mode_t mode,
                                  hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high) {
    const stage_drive_t stage = same(without_model(c, mode, reference));
    state->events = 0;
    turn_to(c, state, mode, stage.amplifier);
    state->settled = false; /* the filters stand still */
    state->continues = false;
    return apply(c, state, hyst_compensator_memory(state), stage, low, high, NULL, any_of(c));
}

static HYST_WITHIN hyst_q31_t step(const hyst_compensator_t *compensator, hyst_compensator_state_t *state,
                                   hyst_mode_t mode, hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high) {
    if (mode != HYST_MODE_COMPENSATE) {
        return pass(compensator, state, mode, reference, low, high);
    }
    if (!state->continues) {
        return begin(compensator, state, reference, low, high);
    }
    const unsigned others = compensator->stages & ~FILTERS;
    if (others == 0) {
        return go_on_plays(compensator, state, mode, reference, low, high);
    }
    if (others == FAMILY) {
        return go_on_family(compensator, state, mode, reference, low, high);
    }
    if (others == LINE) {
        return go_on_line(compensator, state, mode, reference, low, high);
    }
    return go_on_any(compensator, state, mode, reference, low, high);
}

/* Inline where the program is compiled as a whole. */
inline hyst_q31_t hyst_compensator_step_within(const hyst_compensator_t *compensator, hyst_compensator_state_t *state,
                                               hyst_mode_t mode, hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high,
                                               unsigned *events) {
    const hyst_q31_t drive = step(compensator, state, mode, reference, low, high);
    *events = state->events;
    return drive;
}

HYST_APART bool hyst_compensator_adopt(const hyst_compensator_t *from, const hyst_compensator_t *to,
                                       hyst_compensator_state_t *state) {
    const uint32_t next = 1U - state->memory_in_use;
    hyst_hysteresis_state_t *memory = &state->memory[next];
    /* Asked for only where nothing can be carried. */
    const bool other_family = from->hysteresis.family != to->hysteresis.family;
    const hyst_q31_t seen = other_family ? curved(to, state->drive) : state->drive;
    if (!hyst_hysteresis_carry(&from->hysteresis, hyst_compensator_memory(state), &to->hysteresis, memory, seen,
                               &state->carried)) {
        return false;
    }
    state->memory_in_use = next;
    state->carried = 0;
    if (from->creep.cells != to->creep.cells || other_family) {
        hyst_creep_settle(&to->creep, &state->creep, hyst_hysteresis_output(&to->hysteresis, memory));
    }
    if (from->reference_curved || to->reference_curved || from->cascades != to->cascades) {
        state->settled = false; /* another input or cascade: its state starts settled at the next reference */
    }
    state->adopted = true;
    state->continues = false;
    return true;
}
