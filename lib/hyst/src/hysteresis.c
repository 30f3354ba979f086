/* SPDX-License-Identifier: MIT */
#include "hyst/hysteresis.h"

void hyst_hysteresis_reset(const hyst_hysteresis_t *model, hyst_hysteresis_state_t *state, hyst_q31_t drive) {
    switch (model->family) {
    case HYST_FAMILY_PREISACH:
        hyst_preisach_reset(&model->preisach, &state->preisach, drive);
        break;
    case HYST_FAMILY_BOUC_WEN:
        hyst_bouc_wen_reset(&model->bouc_wen, &state->bouc_wen, drive);
        break;
    case HYST_FAMILY_MODIFIED_PLAY:
        hyst_modified_play_reset(&model->modified_play, &state->modified_play, drive);
        break;
    case HYST_FAMILY_PRANDTL_ISHLINSKII:
    case HYST_FAMILY_COUNT:
        hyst_pi_reset(&model->prandtl_ishlinskii, &state->prandtl_ishlinskii, drive);
        break;
    }
}

void hyst_hysteresis_advance(const hyst_hysteresis_t *model, hyst_hysteresis_state_t *state, hyst_q31_t drive) {
    switch (model->family) {
    case HYST_FAMILY_PREISACH:
        hyst_preisach_advance(&model->preisach, &state->preisach, drive);
        break;
    case HYST_FAMILY_BOUC_WEN:
        hyst_bouc_wen_advance(&model->bouc_wen, &state->bouc_wen, drive);
        break;
    case HYST_FAMILY_MODIFIED_PLAY:
        hyst_modified_play_advance(&model->modified_play, &state->modified_play, drive);
        break;
    case HYST_FAMILY_PRANDTL_ISHLINSKII:
    case HYST_FAMILY_COUNT:
        hyst_pi_advance(&model->prandtl_ishlinskii, &state->prandtl_ishlinskii, drive);
        break;
    }
}

hyst_q31_t hyst_hysteresis_output(const hyst_hysteresis_t *model, const hyst_hysteresis_state_t *state) {
    switch (model->family) {
    case HYST_FAMILY_PREISACH:
        return hyst_preisach_output(&model->preisach, &state->preisach);
    case HYST_FAMILY_BOUC_WEN:
        return hyst_bouc_wen_output(&model->bouc_wen, &state->bouc_wen);
    case HYST_FAMILY_MODIFIED_PLAY:
        return hyst_modified_play_output(&model->modified_play, &state->modified_play);
    case HYST_FAMILY_PRANDTL_ISHLINSKII:
    case HYST_FAMILY_COUNT:
        break;
    }
    return hyst_pi_output(&model->prandtl_ishlinskii, &state->prandtl_ishlinskii);
}

hyst_q31_t hyst_hysteresis_solve(const hyst_hysteresis_t *model, const hyst_hysteresis_state_t *state,
                                 hyst_q31_t position, bool *saturated) {
    switch (model->family) {
    case HYST_FAMILY_PREISACH:
        return hyst_preisach_solve(&model->preisach, &state->preisach, position, saturated);
    case HYST_FAMILY_BOUC_WEN:
        return hyst_bouc_wen_solve(&model->bouc_wen, &state->bouc_wen, position, saturated);
    case HYST_FAMILY_MODIFIED_PLAY:
        return hyst_modified_play_solve(&model->modified_play, &state->modified_play, position, saturated);
    case HYST_FAMILY_PRANDTL_ISHLINSKII:
    case HYST_FAMILY_COUNT:
        break;
    }
    return hyst_pi_solve(&model->prandtl_ishlinskii, &state->prandtl_ishlinskii, position, saturated);
}

void hyst_hysteresis_begin_sine(const hyst_hysteresis_t *model, hyst_hysteresis_state_t *state) {
    if (model->family == HYST_FAMILY_MODIFIED_PLAY) {
        const hyst_modified_play_parameters_t *p = &model->modified_play.parameters;
        hyst_modified_play_set_phase(&model->modified_play, &state->modified_play, p->phase - p->phase_step);
    }
}

bool hyst_hysteresis_carry(const hyst_hysteresis_t *from, const hyst_hysteresis_state_t *from_state,
                           const hyst_hysteresis_t *to, hyst_hysteresis_state_t *to_state, hyst_q31_t drive,
                           uint32_t *carried) {
    if (from->family != to->family) {
        hyst_hysteresis_reset(to, to_state, drive);
        return true;
    }
    if (to->family == HYST_FAMILY_PRANDTL_ISHLINSKII) {
        return hyst_pi_carry(&from->prandtl_ishlinskii, &from_state->prandtl_ishlinskii, &to->prandtl_ishlinskii,
                             &to_state->prandtl_ishlinskii, carried);
    }
    if (to->family == HYST_FAMILY_BOUC_WEN) {
        return hyst_bouc_wen_carry(&from->bouc_wen, &from_state->bouc_wen, &to->bouc_wen, &to_state->bouc_wen, carried);
    }
    if (to->family == HYST_FAMILY_PREISACH) {
        return hyst_preisach_carry(&from->preisach, &from_state->preisach, &to->preisach, &to_state->preisach, carried);
    }
    hyst_modified_play_carry(&from->modified_play, &from_state->modified_play, &to->modified_play,
                             &to_state->modified_play);
    return true;
}
