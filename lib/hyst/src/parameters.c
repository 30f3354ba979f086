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
    SCALAR(26, reference_curves),
    SCALAR(27, shape_sections),
    SCALAR(28, inertia_sections),
    SCALAR(29, equalise_sections),
    SCALAR(30, creep_cells),
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
    ARRAY(reference_curves, reference_curve, 1, HYST_FIELD_REFERENCE_CURVES, .extra = 0),
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

static hyst_parameters_fault_t fault(hyst_parameters_error_t error, hyst_field_t field) {
    return (hyst_parameters_fault_t){.error = error, .field = field};
}

hyst_parameters_fault_t hyst_parameters_decode(const uint32_t *words, size_t count, hyst_parameters_t *parameters) {
    if (count < HYST_IMAGE_MIN_WORDS || count > HYST_IMAGE_MAX_WORDS) {
        return fault(HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS);
    }
    if (words[0] != HYST_IMAGE_MAGIC) {
        return fault(HYST_PARAMETERS_BAD_MAGIC, HYST_FIELD_MAGIC);
    }
    if (words[1] != HYST_IMAGE_VERSION) {
        return fault(HYST_PARAMETERS_BAD_VERSION, HYST_FIELD_VERSION);
    }
    if (words[2] != count) {
        return fault(HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS);
    }
    if (words[count - 1U] != hyst_crc32(words, count - 1U)) {
        return fault(HYST_PARAMETERS_BAD_CRC, HYST_FIELD_CRC);
    }
    memset(parameters, 0, sizeof *parameters);
    for (size_t i = 0; i < SCALARS; i++) {
        memcpy((char *)parameters + scalars[i].offset, &words[scalars[i].word], sizeof words[0]);
    }
    hyst_field_t field = HYST_FIELD_NONE;
    const size_t length = image_words(parameters, &field);
    if (length == 0) {
        return fault(HYST_PARAMETERS_OUT_OF_RANGE, field);
    }
    if (count != length) {
        return fault(HYST_PARAMETERS_BAD_LENGTH, HYST_FIELD_WORDS);
    }
    const uint32_t *at = words + HYST_IMAGE_HEADER_WORDS;
    for (size_t i = 0; i < ARRAYS; i++) {
        const size_t size = array_words(parameters, &arrays[i]);
        memcpy((char *)parameters + arrays[i].array, at, size * sizeof *at);
        at += size;
    }
    return fault(HYST_PARAMETERS_OK, HYST_FIELD_NONE);
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
        [HYST_PARAMETERS_TOO_COSTLY] = "takes longer than a period of the loop",
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
        [HYST_FIELD_REFERENCE_CURVES] = "reference_curves",
        [HYST_FIELD_REFERENCE_CURVE] = "reference_curve",
    };
    const size_t index = (size_t)field;
    return index < HYST_FIELD_COUNT ? texts[index] : "unknown field";
}
