/* SPDX-License-Identifier: MIT */
/**
 * One interface to every family of hysteresis models that the loop can run.
 *
 *   family                                                                                header
 *   HYST_FAMILY_PRANDTL_ISHLINSKII  weighted plays, fixed or rate-dependent thresholds    prandtl_ishlinskii.h
 *   HYST_FAMILY_PREISACH            Everett table over the drive plane                    preisach.h
 *   HYST_FAMILY_BOUC_WEN            two mirrored branch curves                            bouc_wen.h
 *   HYST_FAMILY_MODIFIED_PLAY       plane of plays, third-order feedback, odd harmonics   modified_play.h
 *
 * (Stop sums, densities and ellipses become one of these when a model is compiled: docs/MODELS.md.) All of them invert
 * exactly: the drive that solve returns brings the output to the wanted position at this sample, up to the rounding
 * that each header states. What each function does is the same for all families and written in the family's header.
 *
 *   reset     memory after a slow move from the demagnetised state to `drive`.
 *   advance   moves the memory by one sample to the drive that was really applied.
 *   output    position at the present memory and drive.
 *   solve     the drive for a position at this sample. The memory is not moved. Out of reach: the nearer end of the
 *             range, and *saturated is set (else it is left alone).
 *   begin_sine  a source begins a sine: its first value is the reference of the next sample. Locks what has a phase
 *               (the harmonics of the modified play model), does nothing to the others
 *
 * Preconditions: model built by the family's own build function, family set. Total for such a model and any input.
 * May be called from: interrupt, main loop, host. Reentrant; the caller owns model and state.
 */
#ifndef HYST_HYSTERESIS_H
#define HYST_HYSTERESIS_H

#include "hyst/bouc_wen.h"
#include "hyst/modified_play.h"
#include "hyst/prandtl_ishlinskii.h"
#include "hyst/preisach.h"

/** Values are part of the Modbus interface and of the parameter image: append only. */
typedef enum {
    HYST_FAMILY_PRANDTL_ISHLINSKII = 0,
    HYST_FAMILY_PREISACH = 1,
    HYST_FAMILY_BOUC_WEN = 2,
    HYST_FAMILY_MODIFIED_PLAY = 3,
    HYST_FAMILY_COUNT
} hyst_family_t;

/** Coefficients of the one family that is in use. */
typedef struct {
    hyst_family_t family;
    union {
        hyst_pi_t prandtl_ishlinskii;
        hyst_preisach_t preisach;
        hyst_bouc_wen_t bouc_wen;
        hyst_modified_play_t modified_play;
    };
} hyst_hysteresis_t;

/** Memory; which member is in use is the model's business. */
typedef union {
    hyst_pi_state_t prandtl_ishlinskii;
    hyst_preisach_state_t preisach;
    hyst_bouc_wen_state_t bouc_wen;
    hyst_modified_play_state_t modified_play;
} hyst_hysteresis_state_t;

void hyst_hysteresis_reset(const hyst_hysteresis_t *model, hyst_hysteresis_state_t *state, hyst_q31_t drive);

void hyst_hysteresis_advance(const hyst_hysteresis_t *model, hyst_hysteresis_state_t *state, hyst_q31_t drive);

hyst_q31_t hyst_hysteresis_output(const hyst_hysteresis_t *model, const hyst_hysteresis_state_t *state);

hyst_q31_t hyst_hysteresis_solve(const hyst_hysteresis_t *model, const hyst_hysteresis_state_t *state,
                                 hyst_q31_t position, bool *saturated);

/** What find found, for follow. Belongs to that memory as it is. */
typedef union {
    hyst_pi_found_t prandtl_ishlinskii;
    hyst_bouc_wen_found_t bouc_wen;
} hyst_hysteresis_found_t;

/** As solve, and tells follow what it found. */
static inline hyst_q31_t hyst_hysteresis_find(const hyst_hysteresis_t *model, const hyst_hysteresis_state_t *state,
                                              hyst_q31_t position, bool *saturated, hyst_hysteresis_found_t *found) {
    if (model->family == HYST_FAMILY_PRANDTL_ISHLINSKII) {
        const hyst_q31_t drive =
            hyst_pi_find(&model->prandtl_ishlinskii, &state->prandtl_ishlinskii, position, &found->prandtl_ishlinskii);
        if (found->prandtl_ishlinskii.unreachable) {
            *saturated = true;
        }
        return drive;
    }
    if (model->family == HYST_FAMILY_BOUC_WEN) {
        return hyst_bouc_wen_find(&model->bouc_wen, &state->bouc_wen, position, saturated, &found->bouc_wen);
    }
    if (model->family == HYST_FAMILY_PREISACH) {
        return hyst_preisach_solve(&model->preisach, &state->preisach, position, saturated);
    }
    return hyst_modified_play_solve(&model->modified_play, &state->modified_play, position, saturated);
}

/** As advance. `found` is what find made of this memory: where its drive was applied as it was, less is to be done. */
static inline void hyst_hysteresis_follow(const hyst_hysteresis_t *model, hyst_hysteresis_state_t *state,
                                          hyst_q31_t drive, const hyst_hysteresis_found_t *found) {
    if (model->family == HYST_FAMILY_PRANDTL_ISHLINSKII) {
        hyst_pi_follow(&model->prandtl_ishlinskii, &state->prandtl_ishlinskii, drive, &found->prandtl_ishlinskii);
    } else if (model->family == HYST_FAMILY_BOUC_WEN) {
        hyst_bouc_wen_follow(&model->bouc_wen, &state->bouc_wen, drive, &found->bouc_wen);
    } else {
        hyst_hysteresis_advance(model, state, drive);
    }
}

void hyst_hysteresis_begin_sine(const hyst_hysteresis_t *model, hyst_hysteresis_state_t *state);

/**
 * Carries the memory over to another model, a bounded portion a call. Set *carried to 0, then call until the answer is
 * true; between two calls from_state may be advanced once, by `from`. Within a family as its header says; a play bank
 * takes HYST_PI_CARRY_CALLS calls at most, a Preisach model HYST_PREISACH_CARRY_CALLS, a Bouc-Wen model
 * HYST_BOUC_WEN_CARRY_CALLS, a modified play model 1. Between families nothing can be carried, and the memory is that
 * of a reset at `drive`, the last one: condition the actuator again. to_state may not be from_state.
 */
bool hyst_hysteresis_carry(const hyst_hysteresis_t *from, const hyst_hysteresis_state_t *from_state,
                           const hyst_hysteresis_t *to, hyst_hysteresis_state_t *to_state, hyst_q31_t drive,
                           uint32_t *carried);

#endif
