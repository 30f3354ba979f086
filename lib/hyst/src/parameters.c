/* SPDX-License-Identifier: MIT */
#include "hyst/parameters.h"
#include <string.h>

/* One and the same table of the header's scalar words serves both directions. */
typedef struct {
    uint8_t word;
    uint16_t offset; /* of a 32-bit member of hyst_parameters_t */
} scalar_t;

#define SCALAR(number, member)                                                                                         \
    { .word = (number), .offset = (uint16_t)offsetof(hyst_parameters_t, member) }

static const scalar_t scalars[] = {
    SCALAR(3, model_id),
    SCALAR(4, sample_rate_mhz),
    SCALAR(5, drive_center_uv),
    SCALAR(6, drive_half_range_uv),
    SCALAR(7, position_center_pm),
    SCALAR(8, position_half_range_pm),
    SCALAR(9, drive_low),
    SCALAR(10, drive_high),
    SCALAR(11, drive_park),
    SCALAR(12, linear_offset),
    SCALAR(13, linear_gain),
    SCALAR(14, transition_slew),
    SCALAR(15, lookahead_samples),
    SCALAR(16, family),
    SCALAR(17, hysteresis_offset),
    SCALAR(18, pi_operators),
    SCALAR(19, pi_beta),
    SCALAR(20, pi_rate_gain),
    SCALAR(21, preisach_intervals),
    SCALAR(22, bouc_wen_cells),
    SCALAR(23, bouc_wen_direct),
    SCALAR(24, modified_plays),
    SCALAR(25, drive_curves),
    SCALAR(26, shape_sections),
    SCALAR(27, inertia_sections),
    SCALAR(28, equalise_sections),
    SCALAR(29, creep_cells),
};
#define SCALARS (sizeof scalars / sizeof scalars[0])
_Static_assert(SCALARS == HYST_IMAGE_HEADER_WORDS - 3U, "every header word after the length has its member");

/* The arrays behind the header, in their order: `words` 32-bit words an element. */
typedef struct {
    uint16_t count; /* offset of the member that counts the elements */
    uint16_t array; /* offset of the first element */
    uint16_t most;  /* of the count */
    uint8_t extra;  /* elements beyond the count */
    bool triangle;  /* the count is the side of a triangle: n (n + 1) / 2 elements */
    uint8_t words;
    hyst_field_t count_field; /* what a count out of range is reported as */
} array_t;

#define ARRAY(count_member, array_member, limit, field, ...)                                                           \
    {                                                                                                                  \
        .count = (uint16_t)offsetof(hyst_parameters_t, count_member),                                                  \
        .array = (uint16_t)offsetof(hyst_parameters_t, array_member), .most = (limit), .count_field = (field),         \
        .words = sizeof((hyst_parameters_t *)0)->array_member[0] / sizeof(uint32_t), __VA_ARGS__                       \
    }

static const array_t arrays[] = {
    ARRAY(pi_operators, pi_weight, HYST_PI_MAX_OPERATORS, HYST_FIELD_PI_OPERATORS, .extra = 1),
    ARRAY(pi_operators, pi_threshold, HYST_PI_MAX_OPERATORS, HYST_FIELD_PI_OPERATORS, .extra = 0),
    ARRAY(preisach_intervals, preisach_everett, HYST_PREISACH_MAX_INTERVALS, HYST_FIELD_PREISACH_INTERVALS,
          .triangle = true),
    ARRAY(bouc_wen_cells, bouc_wen_length, HYST_BOUC_WEN_MAX_CELLS, HYST_FIELD_BOUC_WEN_CELLS, .extra = 0),
    ARRAY(bouc_wen_cells, bouc_wen_slope, HYST_BOUC_WEN_MAX_CELLS, HYST_FIELD_BOUC_WEN_CELLS, .extra = 0),
    ARRAY(modified_plays, modified_play, 1, HYST_FIELD_MODIFIED_PLAYS, .extra = 0),
    ARRAY(drive_curves, drive_curve, 1, HYST_FIELD_DRIVE_CURVES, .extra = 0),
    ARRAY(shape_sections, shape, HYST_IIR_MAX_SECTIONS, HYST_FIELD_SHAPE_SECTIONS, .extra = 0),
    ARRAY(inertia_sections, inertia, HYST_INERTIA_MAX_SECTIONS, HYST_FIELD_INERTIA_SECTIONS, .extra = 0),
    ARRAY(equalise_sections, equalise, HYST_IIR_MAX_SECTIONS, HYST_FIELD_EQUALISE_SECTIONS, .extra = 0),
    ARRAY(creep_cells, creep, HYST_CREEP_MAX_CELLS, HYST_FIELD_CREEP_CELLS, .extra = 0),
};
#define ARRAYS (sizeof arrays / sizeof arrays[0])
_Static_assert(sizeof(hyst_iir_section_t) == 20 && sizeof(hyst_creep_cell_t) == 8, "elements are words, unpadded");
_Static_assert(sizeof(hyst_modified_play_parameters_t) == (18U + HYST_MODIFIED_PLAY_MAX_CELLS) * 4U, "likewise");

uint32_t hyst_crc32(const uint32_t *words, size_t count) {
    uint32_t crc = 0xFFFFFFFFU;
    for (size_t i = 0; i < count; i++) {
        crc ^= words[i]; /* four bytes, least significant first, in a reflected CRC: one 32-bit exclusive or */
        for (unsigned bit = 0; bit < 32; bit++) {
            crc = (crc >> 1) ^ (0xEDB88320U & (0U - (crc & 1U)));
        }
    }
    return ~crc;
}

static uint32_t count_of(const hyst_parameters_t *parameters, const array_t *array) {
    uint32_t count;
    memcpy(&count, (const char *)parameters + array->count, sizeof count);
    return count;
}

/* Words that the array takes in the image; its count is in range. */
static size_t array_words(const hyst_parameters_t *parameters, const array_t *array) {
    const size_t count = count_of(parameters, array);
    return array->triangle ? HYST_PREISACH_ELEMENTS(count) : (count + array->extra) * array->words;
}

/* Length of the image, or 0 when a count is out of range; *field is the count's then. */
static size_t image_words(const hyst_parameters_t *parameters, hyst_field_t *field) {
    size_t length = HYST_IMAGE_HEADER_WORDS + 1U;
    for (size_t i = 0; i < ARRAYS; i++) {
        if (count_of(parameters, &arrays[i]) > arrays[i].most) {
            *field = arrays[i].count_field;
            return 0;
        }
        length += array_words(parameters, &arrays[i]);
    }
    return length;
}

size_t hyst_parameters_encode(const hyst_parameters_t *parameters, uint32_t *words, size_t capacity) {
    hyst_field_t field;
    const size_t length = image_words(parameters, &field);
    if (length == 0 || length > capacity) {
        return 0;
    }
    words[0] = HYST_IMAGE_MAGIC;
    words[1] = HYST_IMAGE_VERSION;
    words[2] = (uint32_t)length;
    for (size_t i = 0; i < SCALARS; i++) {
        memcpy(&words[scalars[i].word], (const char *)parameters + scalars[i].offset, sizeof words[0]);
    }
    uint32_t *at = words + HYST_IMAGE_HEADER_WORDS;
    for (size_t i = 0; i < ARRAYS; i++) {
        const size_t count = array_words(parameters, &arrays[i]);
        memcpy(at, (const char *)parameters + arrays[i].array, count * sizeof *at);
        at += count;
    }
    *at = hyst_crc32(words, length - 1U);
    return length;
}

static hyst_parameters_fault_t fault(hyst_parameters_error_t error, hyst_field_t field, uint32_t element) {
    return (hyst_parameters_fault_t){.error = error, .field = field, .element = element};
}

static hyst_parameters_fault_t no_fault(void) {
    return fault(HYST_PARAMETERS_OK, HYST_FIELD_NONE, 0);
}

hyst_parameters_fault_t hyst_parameters_decode(const uint32_t *words, size_t count, hyst_parameters_t *parameters) {
    if (count < HYST_IMAGE_MIN_WORDS || count > HYST_IMAGE_MAX_WORDS) {
        return fault(HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS, 0);
    }
    if (words[0] != HYST_IMAGE_MAGIC) {
        return fault(HYST_PARAMETERS_BAD_MAGIC, HYST_FIELD_MAGIC, 0);
    }
    if (words[1] != HYST_IMAGE_VERSION) {
        return fault(HYST_PARAMETERS_BAD_VERSION, HYST_FIELD_VERSION, 0);
    }
    if (words[2] != count) {
        return fault(HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS, 0);
    }
    if (words[count - 1U] != hyst_crc32(words, count - 1U)) {
        return fault(HYST_PARAMETERS_BAD_CRC, HYST_FIELD_CRC, 0);
    }
    memset(parameters, 0, sizeof *parameters);
    for (size_t i = 0; i < SCALARS; i++) {
        memcpy((char *)parameters + scalars[i].offset, &words[scalars[i].word], sizeof words[0]);
    }
    hyst_field_t field = HYST_FIELD_NONE;
    const size_t length = image_words(parameters, &field);
    if (length == 0) {
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, field, 0);
    }
    if (count != length) {
        return fault(HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS, 0);
    }
    const uint32_t *at = words + HYST_IMAGE_HEADER_WORDS;
    for (size_t i = 0; i < ARRAYS; i++) {
        const size_t size = array_words(parameters, &arrays[i]);
        memcpy((char *)parameters + arrays[i].array, at, size * sizeof *at);
        at += size;
    }
    return no_fault();
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

static hyst_parameters_fault_t build_curve(const hyst_parameters_t *p, hyst_compensator_t *compensator) {
    uint32_t element = 0;
    compensator->curved = p->drive_curves > 0;
    if (p->drive_curves > 1) {
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, HYST_FIELD_DRIVE_CURVES, 0);
    }
    if (!compensator->curved) {
        return no_fault();
    }
    if (hyst_curve_build(&compensator->drive_curve, p->drive_curve[0].node, &element) != HYST_CURVE_OK) {
        return fault(HYST_PARAMETERS_NOT_INVERTIBLE, HYST_FIELD_DRIVE_CURVE, element);
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
        found = build_curve(parameters, compensator);
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
    return found;
}

void hyst_parameters_default(hyst_parameters_t *parameters) {
    memset(parameters, 0, sizeof *parameters);
    parameters->sample_rate_mhz = 10000000U;
    parameters->drive_half_range_uv = 1000000;
    parameters->position_half_range_pm = 1000000;
    parameters->drive_low = HYST_Q31_MIN;
    parameters->drive_high = HYST_Q31_MAX;
    parameters->linear_gain = HYST_Q28_ONE;
    parameters->transition_slew = HYST_Q31_MAX / 1000; /* the whole range in 0.2 s at 10 kHz */
    parameters->pi_rate_gain = HYST_Q30_ONE;
    parameters->pi_weight[0] = HYST_Q28_ONE;
}

const char *hyst_parameters_error_text(hyst_parameters_error_t error) {
    static const char *const texts[] = {
        [HYST_PARAMETERS_OK] = "accepted",
        [HYST_PARAMETERS_BAD_LENGTH] = "wrong length",
        [HYST_PARAMETERS_BAD_MAGIC] = "not a parameter image",
        [HYST_PARAMETERS_BAD_VERSION] = "unknown image version",
        [HYST_PARAMETERS_BAD_CRC] = "checksum does not match",
        [HYST_PARAMETERS_OUT_OF_RANGE] = "out of range",
        [HYST_PARAMETERS_INCONSISTENT] = "contradicts another field",
        [HYST_PARAMETERS_NOT_INVERTIBLE] = "not invertible",
        [HYST_PARAMETERS_UNSTABLE] = "unstable",
    };
    const size_t index = (size_t)error;
    return index < sizeof texts / sizeof texts[0] ? texts[index] : "unknown error";
}

const char *hyst_field_text(hyst_field_t field) {
    static const char *const texts[HYST_FIELD_COUNT] = {
        [HYST_FIELD_NONE] = "none",
        [HYST_FIELD_WORDS] = "words",
        [HYST_FIELD_MAGIC] = "magic",
        [HYST_FIELD_VERSION] = "version",
        [HYST_FIELD_CRC] = "crc",
        [HYST_FIELD_SAMPLE_RATE] = "sample_rate_mhz",
        [HYST_FIELD_DRIVE_HALF_RANGE] = "drive_half_range_uv",
        [HYST_FIELD_POSITION_HALF_RANGE] = "position_half_range_pm",
        [HYST_FIELD_DRIVE_LOW] = "drive_low",
        [HYST_FIELD_DRIVE_HIGH] = "drive_high",
        [HYST_FIELD_DRIVE_PARK] = "drive_park",
        [HYST_FIELD_LINEAR_GAIN] = "linear_gain",
        [HYST_FIELD_TRANSITION_SLEW] = "transition_slew",
        [HYST_FIELD_LOOKAHEAD] = "lookahead_samples",
        [HYST_FIELD_PI_OPERATORS] = "pi_operators",
        [HYST_FIELD_PI_WEIGHT] = "pi_weight",
        [HYST_FIELD_PI_THRESHOLD] = "pi_threshold",
        [HYST_FIELD_PI_BETA] = "pi_beta",
        [HYST_FIELD_PI_RATE_GAIN] = "pi_rate_gain",
        [HYST_FIELD_SHAPE_SECTIONS] = "shape_sections",
        [HYST_FIELD_SHAPE] = "shape",
        [HYST_FIELD_EQUALISE_SECTIONS] = "equalise_sections",
        [HYST_FIELD_EQUALISE] = "equalise",
        [HYST_FIELD_CREEP_CELLS] = "creep_cells",
        [HYST_FIELD_CREEP] = "creep",
        [HYST_FIELD_FAMILY] = "family",
        [HYST_FIELD_PREISACH_INTERVALS] = "preisach_intervals",
        [HYST_FIELD_PREISACH_EVERETT] = "preisach_everett",
        [HYST_FIELD_BOUC_WEN_CELLS] = "bouc_wen_cells",
        [HYST_FIELD_BOUC_WEN_DIRECT] = "bouc_wen_direct",
        [HYST_FIELD_BOUC_WEN_LENGTH] = "bouc_wen_length",
        [HYST_FIELD_BOUC_WEN_SLOPE] = "bouc_wen_slope",
        [HYST_FIELD_MODIFIED_PLAYS] = "modified_plays",
        [HYST_FIELD_MODIFIED_PLAY] = "modified_play",
        [HYST_FIELD_DRIVE_CURVES] = "drive_curves",
        [HYST_FIELD_DRIVE_CURVE] = "drive_curve",
        [HYST_FIELD_INERTIA_SECTIONS] = "inertia_sections",
        [HYST_FIELD_INERTIA] = "inertia",
    };
    const size_t index = (size_t)field;
    return index < HYST_FIELD_COUNT ? texts[index] : "unknown field";
}
