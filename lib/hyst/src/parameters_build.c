/* SPDX-License-Identifier: MIT */
#include "hyst/parameters.h"

static hyst_parameters_fault_t fault(hyst_parameters_error_t error, hyst_field_t field, uint32_t element) {
    return (hyst_parameters_fault_t){.error = error, .field = field, .element = element};
}

static hyst_parameters_fault_t no_fault(void) {
    return fault(HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
}

static hyst_parameters_fault_t check_scalars(const hyst_parameters_t *p) {
    const struct {
        bool good;
        hyst_parameters_error_t error;
        hyst_field_t field;
    } checks[] = {
        {p->sample_rate_mhz >= 1000U && p->sample_rate_mhz <= 1000000000U, HYST_PARAMETERS_OUT_OF_RANGE,
         HYST_FIELD_SAMPLE_RATE},
        {p->drive_half_range_uv > 0, HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_DRIVE_HALF_RANGE},
        {p->position_half_range_pm > 0, HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_POSITION_HALF_RANGE},
        {p->drive_low < p->drive_high, HYST_PARAMETERS_INCONSISTENT, HYST_FIELD_DRIVE_LOW},
        {p->drive_park >= p->drive_low && p->drive_park <= p->drive_high, HYST_PARAMETERS_INCONSISTENT,
         HYST_FIELD_DRIVE_PARK},
        {p->linear_gain > 0, HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_LINEAR_GAIN},
        {p->transition_slew > 0, HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_TRANSITION_SLEW},
        {p->lookahead_samples <= HYST_LOOKAHEAD_MAX, HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_LOOKAHEAD},
    };
    for (size_t i = 0; i < sizeof checks / sizeof checks[0]; i++) {
        if (!checks[i].good) {
            return fault(checks[i].error, checks[i].field, 0);
        }
    }
    return no_fault();
}

static hyst_parameters_fault_t pi_fault(hyst_pi_status_t status, uint32_t element) {
    switch (status) {
    case HYST_PI_OK:
        return no_fault();
    case HYST_PI_TOO_MANY_OPERATORS:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PI_OPERATORS, element);
    case HYST_PI_THRESHOLD_NOT_POSITIVE:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PI_THRESHOLD, element);
    case HYST_PI_THRESHOLD_NOT_RISING:
        return fault(HYST_PARAMETERS_INCONSISTENT, HYST_FIELD_PI_THRESHOLD, element);
    case HYST_PI_WEIGHT_SUM_TOO_LARGE:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PI_WEIGHT, element);
    case HYST_PI_SLOPE_TOO_SMALL:
        return fault(HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_PI_WEIGHT, element);
    case HYST_PI_RATE_GAIN_OUT_OF_RANGE:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PI_RATE_GAIN, element);
    case HYST_PI_BETA_NEGATIVE:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PI_BETA, element);
    case HYST_PI_RATE_FEEDBACK_UNSTABLE:
        break;
    }
    return fault(HYST_PARAMETERS_UNSTABLE, HYST_FIELD_PI_BETA, element);
}

static hyst_parameters_fault_t preisach_fault(hyst_preisach_status_t status, uint32_t element) {
    switch (status) {
    case HYST_PREISACH_OK:
        return no_fault();
    case HYST_PREISACH_INTERVALS_OUT_OF_RANGE:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PREISACH_INTERVALS, 0);
    case HYST_PREISACH_TOO_STEEP:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_PREISACH_EVERETT, element);
    case HYST_PREISACH_RISING_TOO_FLAT:
    case HYST_PREISACH_FALLING_TOO_FLAT:
        break;
    }
    return fault(HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_PREISACH_EVERETT, element);
}

static hyst_parameters_fault_t bouc_wen_fault(hyst_bouc_wen_status_t status, uint32_t element) {
    switch (status) {
    case HYST_BOUC_WEN_OK:
        return no_fault();
    case HYST_BOUC_WEN_TOO_MANY_CELLS:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_BOUC_WEN_CELLS, 0);
    case HYST_BOUC_WEN_LENGTH_NOT_POSITIVE:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_BOUC_WEN_LENGTH, element);
    case HYST_BOUC_WEN_SLOPE_SIGN:
        return fault(HYST_PARAMETERS_INCONSISTENT, HYST_FIELD_BOUC_WEN_SLOPE, element);
    case HYST_BOUC_WEN_TOO_STEEP:
    case HYST_BOUC_WEN_BRANCH_TOO_LONG:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_BOUC_WEN_SLOPE, element);
    case HYST_BOUC_WEN_TOO_FLAT:
        break;
    }
    return fault(HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_BOUC_WEN_SLOPE, element);
}

static hyst_parameters_fault_t modified_play_fault(hyst_modified_play_status_t status, uint32_t element) {
    switch (status) {
    case HYST_MODIFIED_PLAY_OK:
        return no_fault();
    case HYST_MODIFIED_PLAY_DIVISIONS_OUT_OF_RANGE:
    case HYST_MODIFIED_PLAY_COEFFICIENTS_TOO_LARGE:
    case HYST_MODIFIED_PLAY_WEIGHTS_TOO_LARGE:
    case HYST_MODIFIED_PLAY_TOO_STEEP:
    case HYST_MODIFIED_PLAY_RATE_OUT_OF_RANGE:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_MODIFIED_PLAY, element);
    case HYST_MODIFIED_PLAY_TOO_FLAT:
        return fault(HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_MODIFIED_PLAY, element);
    case HYST_MODIFIED_PLAY_FILTER_UNSTABLE:
    case HYST_MODIFIED_PLAY_INVERSE_UNSTABLE:
        break;
    }
    return fault(HYST_PARAMETERS_UNSTABLE, HYST_FIELD_MODIFIED_PLAY, element);
}

/* What belongs to another family than the one that is chosen must not be there. */
static hyst_parameters_fault_t check_family(const hyst_parameters_t *p) {
    const struct {
        uint32_t count, family;
        hyst_field_t field;
    } parts[] = {{p->pi_operators, HYST_FAMILY_PRANDTL_ISHLINSKII, HYST_FIELD_PI_OPERATORS},
                 {p->preisach_intervals, HYST_FAMILY_PREISACH, HYST_FIELD_PREISACH_INTERVALS},
                 {p->bouc_wen_cells, HYST_FAMILY_BOUC_WEN, HYST_FIELD_BOUC_WEN_CELLS},
                 {p->modified_plays, HYST_FAMILY_MODIFIED_PLAY, HYST_FIELD_MODIFIED_PLAYS}};
    if (p->family >= HYST_FAMILY_COUNT) {
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_FAMILY, 0);
    }
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        const bool own = parts[i].family == p->family;
        if (!own && parts[i].count > 0) {
            return fault(HYST_PARAMETERS_INCONSISTENT, parts[i].field, 0);
        }
    }
    return no_fault();
}

static hyst_parameters_fault_t build_hysteresis(const hyst_parameters_t *p, hyst_hysteresis_t *hysteresis) {
    uint32_t element = 0;
    const hyst_parameters_fault_t found = check_family(p);
    if (found.error != HYST_PARAMETERS_OK) {
        return found;
    }
    hysteresis->family = (hyst_family_t)p->family;
    switch (hysteresis->family) {
    case HYST_FAMILY_PREISACH: {
        const hyst_preisach_status_t status = hyst_preisach_build(&hysteresis->preisach, p->preisach_intervals,
                                                                  p->hysteresis_offset, p->preisach_everett, &element);
        return preisach_fault(status, element);
    }
    case HYST_FAMILY_BOUC_WEN: {
        const hyst_bouc_wen_status_t status =
            hyst_bouc_wen_build(&hysteresis->bouc_wen, p->bouc_wen_cells, p->hysteresis_offset, p->bouc_wen_direct,
                                p->bouc_wen_length, p->bouc_wen_slope, &element);
        return bouc_wen_fault(status, element);
    }
    case HYST_FAMILY_MODIFIED_PLAY: {
        if (p->modified_plays != 1) {
            return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_MODIFIED_PLAYS, 0);
        }
        const hyst_modified_play_status_t status =
            hyst_modified_play_build(&hysteresis->modified_play, &p->modified_play[0], &element);
        return modified_play_fault(status, element);
    }
    case HYST_FAMILY_PRANDTL_ISHLINSKII:
    case HYST_FAMILY_COUNT:
        break;
    }
    const hyst_pi_status_t status =
        hyst_pi_build(&hysteresis->prandtl_ishlinskii, p->pi_operators, p->hysteresis_offset, p->pi_weight,
                      p->pi_threshold, p->pi_beta, p->pi_rate_gain, &element);
    return pi_fault(status, element);
}

static hyst_parameters_fault_t filter_fault(hyst_iir_status_t status, hyst_field_t count, hyst_field_t field,
                                            uint32_t element) {
    switch (status) {
    case HYST_IIR_OK:
        return no_fault();
    case HYST_IIR_TOO_MANY_SECTIONS:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, count, 0);
    case HYST_IIR_COEFFICIENTS_TOO_LARGE:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, field, element);
    case HYST_IIR_UNSTABLE:
        break;
    }
    return fault(HYST_PARAMETERS_UNSTABLE, field, element);
}

static hyst_parameters_fault_t creep_fault(hyst_creep_status_t status, uint32_t element) {
    switch (status) {
    case HYST_CREEP_OK:
        return no_fault();
    case HYST_CREEP_TOO_MANY_CELLS:
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_CREEP_CELLS, 0);
    case HYST_CREEP_GAIN_TOO_LARGE:
    case HYST_CREEP_RATE_NOT_POSITIVE:
        break;
    }
    return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_CREEP, element);
}

/* One of the two curves. */
static hyst_parameters_fault_t build_curve(hyst_curve_t *curve, bool *used, uint32_t curves, const hyst_curve_t *given,
                                           hyst_field_t count, hyst_field_t field) {
    uint32_t element = 0;
    *used = curves > 0;
    if (curves > 1) {
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, count, 0);
    }
    if (*used && hyst_curve_build(curve, given->node, &element) != HYST_CURVE_OK) {
        return fault(HYST_PARAMETERS_NOT_INVERTIBLE, field, element);
    }
    return no_fault();
}

/* One of the three filters. */
static hyst_parameters_fault_t build_filter(hyst_iir_t *filter, uint32_t sections, uint32_t most,
                                            const hyst_iir_section_t section[], hyst_field_t count,
                                            hyst_field_t field) {
    uint32_t element = 0;
    if (sections > most) {
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, count, 0);
    }
    const hyst_iir_status_t status = hyst_iir_build(filter, sections, section, &element);
    return filter_fault(status, count, field, element);
}

hyst_parameters_fault_t hyst_parameters_build(const hyst_parameters_t *parameters, hyst_compensator_t *compensator) {
    uint32_t element = 0;
    hyst_parameters_fault_t found = check_scalars(parameters);
    if (found.error == HYST_PARAMETERS_OK) {
        found = build_hysteresis(parameters, &compensator->hysteresis);
    }
    if (found.error == HYST_PARAMETERS_OK) {
        found = build_curve(&compensator->drive_curve, &compensator->curved, parameters->drive_curves,
                            parameters->drive_curve, HYST_FIELD_DRIVE_CURVES, HYST_FIELD_DRIVE_CURVE);
    }
    if (found.error == HYST_PARAMETERS_OK) {
        found = build_curve(&compensator->reference_curve, &compensator->reference_curved, parameters->reference_curves,
                            parameters->reference_curve, HYST_FIELD_REFERENCE_CURVES, HYST_FIELD_REFERENCE_CURVE);
    }
    if (found.error == HYST_PARAMETERS_OK) {
        found = build_filter(&compensator->shape, parameters->shape_sections, HYST_IIR_MAX_SECTIONS, parameters->shape,
                             HYST_FIELD_SHAPE_SECTIONS, HYST_FIELD_SHAPE);
    }
    if (found.error == HYST_PARAMETERS_OK) {
        found = build_filter(&compensator->inertia, parameters->inertia_sections, HYST_INERTIA_MAX_SECTIONS,
                             parameters->inertia, HYST_FIELD_INERTIA_SECTIONS, HYST_FIELD_INERTIA);
    }
    if (found.error == HYST_PARAMETERS_OK) {
        found = build_filter(&compensator->equalise, parameters->equalise_sections, HYST_IIR_MAX_SECTIONS,
                             parameters->equalise, HYST_FIELD_EQUALISE_SECTIONS, HYST_FIELD_EQUALISE);
    }
    if (found.error == HYST_PARAMETERS_OK) {
        const hyst_creep_status_t status =
            hyst_creep_build(&compensator->creep, parameters->creep_cells, parameters->creep, &element);
        found = creep_fault(status, element);
    }
    compensator->drive_low = parameters->drive_low;
    compensator->drive_high = parameters->drive_high;
    compensator->drive_park = parameters->drive_park;
    compensator->linear_offset = parameters->linear_offset;
    compensator->linear_gain = parameters->linear_gain;
    compensator->transition_slew = parameters->transition_slew;
    if (found.error == HYST_PARAMETERS_OK) {
        hyst_compensator_prepare(compensator);
    }
    return found;
}
