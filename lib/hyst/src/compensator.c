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

/* Drive of the hysteresis (before the electronics' inverse) and of the amplifier (after it). */
typedef struct {
    hyst_q31_t hysteresis;
    hyst_q31_t amplifier;
} stage_drive_t;

static stage_drive_t same(hyst_q31_t drive) {
    return (stage_drive_t){.hysteresis = drive, .amplifier = drive};
}

static stage_drive_t compensate(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_q31_t reference,
                                unsigned *events) {
    bool filter_saturated = false;
    bool unreachable = false;
    const hyst_q31_t position = c->reference_curved ? hyst_curve_apply(&c->reference_curve, reference) : reference;
    if (!state->settled) {
        hyst_iir_settle(&c->shape, &state->shape, position);
    }
    const hyst_q31_t shaped = hyst_iir_step(&c->shape, &state->shape, position, &filter_saturated);
    /* |shaped - offset| < 2^32. Saturating makes it the farthest the hysteresis could be asked for. */
    const hyst_q31_t elastic = hyst_saturate(shaped - hyst_creep_offset(&c->creep, &state->creep));
    stage_drive_t drive;
    drive.hysteresis = hyst_hysteresis_solve(&c->hysteresis, hyst_compensator_memory(state), elastic, &unreachable);
    if (c->curved) {
        drive.hysteresis = hyst_curve_solve(&c->drive_curve, drive.hysteresis, &unreachable);
    }
    hyst_q31_t forced = drive.hysteresis;
    if (c->inertia.sections > 0) { /* without sections the cascade is a wire, here it has to be nothing */
        if (!state->settled) {
            hyst_iir_settle(&c->inertia, &state->inertia, elastic);
        }
        forced = hyst_add(forced, hyst_iir_step(&c->inertia, &state->inertia, elastic, &filter_saturated));
    }
    if (!state->settled) {
        hyst_iir_settle(&c->equalise, &state->equalise, forced);
        state->settled = true;
    }
    drive.amplifier = hyst_iir_step(&c->equalise, &state->equalise, forced, &filter_saturated);
    *events |= (unreachable ? (unsigned)HYST_STEP_UNREACHABLE : 0U) |
               (filter_saturated ? (unsigned)HYST_STEP_FILTER_SATURATED : 0U);
    return drive;
}

static stage_drive_t wanted(const hyst_compensator_t *c, hyst_compensator_state_t *state, hyst_mode_t mode,
                            hyst_q31_t reference, unsigned *events) {
    if (mode == HYST_MODE_COMPENSATE) {
        return compensate(c, state, reference, events);
    }
    state->settled = false; /* the filters stand still meanwhile */
    if (mode == HYST_MODE_DIRECT) {
        return same(reference);
    }
    if (mode == HYST_MODE_LINEAR) {
        /* |gain * reference| <= 2^62, so the sum of its 34 bits and the offset is far from 2^63. */
        return same(hyst_saturate(hyst_round_shift(hyst_product(c->linear_gain, reference), 28) + c->linear_offset));
    }
    return same(c->drive_park);
}

static int64_t towards_zero(int64_t x, hyst_q31_t step) {
    if (x > step) {
        return x - step;
    }
    return x < -(int64_t)step ? x + step : 0;
}

hyst_q31_t hyst_compensator_step(const hyst_compensator_t *compensator, hyst_compensator_state_t *state,
                                 hyst_mode_t mode, hyst_q31_t reference, unsigned *events) {
    *events = 0;
    const stage_drive_t stage = wanted(compensator, state, mode, reference, events);
    if (mode != state->mode || state->adopted) {
        state->transition = (int64_t)state->drive - stage.amplifier; /* |.| < 2^32 */
        state->mode = mode;
        state->adopted = false;
    } else {
        state->transition = towards_zero(state->transition, compensator->transition_slew);
    }
    const int64_t sum = stage.amplifier + state->transition; /* |.| < 2^33 */
    if (sum > compensator->drive_high || sum < compensator->drive_low) {
        *events |= (unsigned)HYST_STEP_DRIVE_LIMITED;
    }
    const hyst_q31_t drive = hyst_clamp(hyst_saturate(sum), compensator->drive_low, compensator->drive_high);
    /* Inertia and equalise sections are spent on moving the mass and on the electronics: the hysteresis sees what was
     * there before them. Without any, it sees the drive. */
    const hyst_q31_t seen =
        mode != HYST_MODE_COMPENSATE || (compensator->inertia.sections == 0 && compensator->equalise.sections == 0)
            ? drive
            : hyst_clamp(hyst_saturate(stage.hysteresis + state->transition), compensator->drive_low,
                         compensator->drive_high);
    hyst_hysteresis_state_t *memory = hyst_compensator_memory(state);
    hyst_hysteresis_advance(&compensator->hysteresis, memory, curved(compensator, seen));
    if (compensator->creep.cells > 0) {
        hyst_creep_advance(&compensator->creep, &state->creep,
                           hyst_hysteresis_output(&compensator->hysteresis, memory));
    }
    state->drive = drive;
    return drive;
}

bool hyst_compensator_adopt(const hyst_compensator_t *from, const hyst_compensator_t *to,
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
