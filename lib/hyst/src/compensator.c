/* SPDX-License-Identifier: MIT */
#include "hyst/compensator.h"

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
    state->transition = 0;
    state->adopted = false;
    state->settled = false;
}

void hyst_compensator_prepare(hyst_compensator_t *c) {
    c->stages = (c->reference_curved ? (unsigned)HYST_STAGE_REFERENCE_CURVE : 0U) |
                (c->shape.sections > 0 ? (unsigned)HYST_STAGE_SHAPE : 0U) |
                (c->creep.cells > 0 ? (unsigned)HYST_STAGE_CREEP : 0U) |
                (c->curved ? (unsigned)HYST_STAGE_DRIVE_CURVE : 0U) |
                (c->inertia.sections > 0 ? (unsigned)HYST_STAGE_INERTIA : 0U) |
                (c->equalise.sections > 0 ? (unsigned)HYST_STAGE_EQUALISE : 0U);
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
    return settled ? hyst_iir_step(iir, state, x, saturated) : hyst_iir_begin(iir, state, x, saturated);
}

/* Of `stages` those that there may be: most chains have no others than filters, and a copy of this to themselves. */
static HYST_WITHIN stage_drive_t compensate(const hyst_compensator_t *c, hyst_compensator_state_t *state,
                                            const hyst_hysteresis_state_t *memory, hyst_q31_t reference,
                                            hyst_hysteresis_found_t *found, unsigned *events, unsigned stages,
                                            bool settled) {
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
    stage_drive_t drive = same(hyst_hysteresis_find(&c->hysteresis, memory, elastic, &unreachable, found));
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
    *events = (unreachable ? (unsigned)HYST_STEP_UNREACHABLE : 0U) |
              (filter_saturated ? (unsigned)HYST_STEP_FILTER_SATURATED : 0U);
    return drive;
}

#define FILTERS ((unsigned)HYST_STAGE_SHAPE | (unsigned)HYST_STAGE_EQUALISE)

/* Any chain, and its first sample. */
static HYST_APART stage_drive_t compensate_any(const hyst_compensator_t *c, hyst_compensator_state_t *state,
                                               const hyst_hysteresis_state_t *memory, hyst_q31_t reference,
                                               hyst_hysteresis_found_t *found, unsigned *events) {
    const bool settled = state->settled;
    state->settled = true;
    return compensate(c, state, memory, reference, found, events, c->stages, settled);
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

/* x != 0. */
static inline int64_t towards_zero(int64_t x, hyst_q31_t step) {
    if (x > 0) {
        x -= step;
        return x > 0 ? x : 0;
    }
    x += step;
    return x < 0 ? x : 0;
}

/* A transition of more than 32 bits, as after a step across more than half the range: rare, and in 64 bits. */
static hyst_q31_t far_limited(hyst_q31_t drive, int64_t transition, hyst_q31_t low, hyst_q31_t high, bool *met) {
    const int64_t sum = drive + transition; /* |.| < 2^33 */
    const hyst_q31_t result = hyst_clamp(hyst_saturate(sum), low, high);
    *met = sum != result;
    return result;
}

/* drive + transition, within the limits. */
static inline hyst_q31_t limited(hyst_q31_t drive, int64_t transition, hyst_q31_t low, hyst_q31_t high, bool *met) {
    const int32_t near = (int32_t)transition;
    if (near != transition) {
        return far_limited(drive, transition, low, high, met);
    }
    const hyst_q31_t sum = hyst_add(drive, near);
    const hyst_q31_t result = hyst_clamp(sum, low, high);
    *met = result != sum || (uint32_t)sum != (uint32_t)drive + (uint32_t)near; /* clamped, or saturated */
    return result;
}

/* What the hysteresis and the creep remember of this sample. */
static inline void remember(const hyst_compensator_t *c, hyst_compensator_state_t *state,
                            hyst_hysteresis_state_t *memory, hyst_mode_t mode, hyst_q31_t seen,
                            const hyst_hysteresis_found_t *found) {
    if ((c->stages & HYST_STAGE_DRIVE_CURVE) != 0) {
        seen = hyst_curve_apply(&c->drive_curve, seen);
    }
    if (mode == HYST_MODE_COMPENSATE) {
        hyst_hysteresis_follow(&c->hysteresis, memory, seen, found);
    } else {
        hyst_hysteresis_advance(&c->hysteresis, memory, seen);
    }
    if ((c->stages & HYST_STAGE_CREEP) != 0) {
        hyst_creep_advance(&c->creep, &state->creep, hyst_hysteresis_output(&c->hysteresis, memory));
    }
}

HYST_APART hyst_q31_t hyst_compensator_step_within(const hyst_compensator_t *compensator,
                                                   hyst_compensator_state_t *state, hyst_mode_t mode,
                                                   hyst_q31_t reference, hyst_q31_t low, hyst_q31_t high,
                                                   unsigned *events) {
    hyst_hysteresis_state_t *const memory = hyst_compensator_memory(state);
    hyst_hysteresis_found_t found;
    stage_drive_t stage;
    if (mode == HYST_MODE_COMPENSATE) {
        const unsigned stages = compensator->stages;
        stage = state->settled && (stages & ~FILTERS) == 0
                    ? compensate(compensator, state, memory, reference, &found, events, stages & FILTERS, true)
                    : compensate_any(compensator, state, memory, reference, &found, events);
    } else {
        *events = 0;
        state->settled = false; /* the filters stand still meanwhile */
        stage = same(without_model(compensator, mode, reference));
    }
    int64_t transition = state->transition;
    if (mode != state->mode || state->adopted) {
        transition = (int64_t)state->drive - stage.amplifier; /* |.| < 2^32 */
        state->transition = transition;
        state->mode = mode;
        state->adopted = false;
    } else if (transition != 0) {
        transition = towards_zero(transition, compensator->transition_slew);
        state->transition = transition;
    }
    bool met;
    const hyst_q31_t drive = limited(stage.amplifier, transition, low, high, &met);
    if (met) {
        *events |= (unsigned)HYST_STEP_DRIVE_LIMITED;
    }
    state->drive = drive;
    /* Inertia and equalise sections are spent on moving the mass and on the electronics: the hysteresis sees what was
     * there before them. Without any, it sees the drive. */
    hyst_q31_t seen = drive;
    if (stage.hysteresis != stage.amplifier) {
        seen = limited(stage.hysteresis, transition, low, high, &met);
    }
    remember(compensator, state, memory, mode, seen, &found);
    return drive;
}

HYST_APART bool hyst_compensator_adopt(const hyst_compensator_t *from, const hyst_compensator_t *to,
                                       hyst_compensator_state_t *state) {
    const uint32_t next = 1U - state->memory_in_use;
    hyst_hysteresis_state_t *memory = &state->memory[next];
    if (!hyst_hysteresis_carry(&from->hysteresis, hyst_compensator_memory(state), &to->hysteresis, memory,
                               curved(to, state->drive), &state->carried)) {
        return false;
    }
    state->memory_in_use = next;
    state->carried = 0;
    if (from->creep.cells != to->creep.cells || from->hysteresis.family != to->hysteresis.family) {
        hyst_creep_settle(&to->creep, &state->creep, hyst_hysteresis_output(&to->hysteresis, memory));
    }
    if (from->reference_curved || to->reference_curved || from->shape.sections != to->shape.sections ||
        from->inertia.sections != to->inertia.sections || from->equalise.sections != to->equalise.sections) {
        state->settled = false; /* another input or cascade: its state starts settled at the next reference */
    }
    state->adopted = true;
    return true;
}
