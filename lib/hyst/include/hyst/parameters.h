/* SPDX-License-Identifier: MIT */
/**
 * The parameter image: everything the compensator needs, in one versioned block of 32-bit words with a CRC-32.
 *
 * Layout, words in this order (an image is HYST_IMAGE_MIN_WORDS to HYST_IMAGE_MAX_WORDS long):
 *
 *     0  magic           'HYST' = 0x48595354
 *     1  version         HYST_IMAGE_VERSION
 *     2  words           length of the whole image, CRC included
 *     3  model_id        free for the host: identifies the model the image was compiled from
 *     4  sample_rate_mhz sample rate the image was made for, in millihertz
 *     5  drive_center_uv       6  drive_half_range_uv      drive in microvolts = center + half_range * Q31 fraction
 *     7  position_center_pm    8  position_half_range_pm   position in picometres, likewise
 *     9  drive_low      10  drive_high      11  drive_park                       Q31
 *     12 linear_offset  Q31                 13  linear_gain  Q28
 *     14 transition_slew  Q31, > 0 (a board allows less: board_limits.h)   15  lookahead_samples  0..HYST_LOOKAHEAD_MAX
 *     16 family, hyst_family_t              17 hysteresis_offset  Q31, see the header of the family
 *     18 pi_operators n   19 pi_beta Q20 (samples)       20 pi_rate_gain Q30
 *     21 preisach_intervals N, 0 but for its family
 *     22 bouc_wen_cells n, 0 but for its family          23 bouc_wen_direct Q28
 *     24 modified_plays   1 for its family, else 0
 *     25 drive_curves, 0 or 1               26 reference_curves, 0 or 1
 *     27 shape_sections   28 inertia_sections   29 equalise_sections   30 creep_cells
 *     31 ...
 *        w_0..w_n            Q28            (w_0 stands in every image; it is used by its family only)
 *        a_1..a_n            Q31
 *        E(i,j)              Q28, N (N + 1) / 2 elements, see preisach.h
 *        length_1..length_n  Q31, then slope_1..slope_n Q28, see bouc_wen.h
 *        a hyst_modified_play_parameters_t, word by word
 *        nodes of the drive curve       Q31, HYST_CURVE_NODES: what the operators see of a drive
 *        nodes of the reference curve   likewise: the position where the sensor reads the reference
 *        b0 b1 b2 a1 a2      Q28, per shape section, then per inertia section, then per equalise section
 *        gain rate           Q31, per creep cell
 *     last word: CRC-32 (IEEE 802.3, reflected, initial and final 0xFFFFFFFF) of all earlier words, each taken least
 *     significant byte first
 *
 * The format has its own version, separate from the firmware's and the register map's.
 * May be called from: main loop, host. Not from the interrupt (a decode walks the whole image).
 */
#ifndef HYST_PARAMETERS_H
#define HYST_PARAMETERS_H

#include "hyst/compensator.h"
#include <stddef.h>

#define HYST_IMAGE_MAGIC        0x48595354U
#define HYST_IMAGE_VERSION      3U
#define HYST_IMAGE_HEADER_WORDS 31U
#define HYST_IMAGE_MIN_WORDS    (HYST_IMAGE_HEADER_WORDS + 1U + 1U) /* w_0 and the CRC */
/* The largest play bank with everything that can stand around it. No other family needs as much. */
#define HYST_IMAGE_MAX_WORDS                                                                                           \
    (HYST_IMAGE_HEADER_WORDS + 1U + 2U * HYST_PI_MAX_OPERATORS + 2U * HYST_CURVE_NODES +                               \
     (2U * HYST_IIR_MAX_SECTIONS + 1U) * 5U + 2U * HYST_CREEP_MAX_CELLS + 1U)
/** Sections of the inertia filter: one, which holds the mass' and the damper's share of the drive. */
#define HYST_INERTIA_MAX_SECTIONS 1U
#define HYST_LOOKAHEAD_MAX        63U

/** The image, decoded. */
typedef struct {
    uint32_t model_id;
    uint32_t sample_rate_mhz;
    int32_t drive_center_uv;
    int32_t drive_half_range_uv;
    int32_t position_center_pm;
    int32_t position_half_range_pm;
    hyst_q31_t drive_low, drive_high, drive_park;
    hyst_q31_t linear_offset;
    hyst_q28_t linear_gain;
    hyst_q31_t transition_slew;
    uint32_t lookahead_samples;
    uint32_t family;
    hyst_q31_t hysteresis_offset;
    uint32_t pi_operators;
    hyst_q20_t pi_beta;
    hyst_q30_t pi_rate_gain;
    hyst_q28_t pi_weight[HYST_PI_MAX_OPERATORS + 1];
    hyst_q31_t pi_threshold[HYST_PI_MAX_OPERATORS];
    uint32_t preisach_intervals;
    hyst_q28_t preisach_everett[HYST_PREISACH_MAX_ELEMENTS];
    uint32_t bouc_wen_cells;
    hyst_q28_t bouc_wen_direct;
    hyst_q31_t bouc_wen_length[HYST_BOUC_WEN_MAX_CELLS];
    hyst_q28_t bouc_wen_slope[HYST_BOUC_WEN_MAX_CELLS];
    uint32_t modified_plays;
    hyst_modified_play_parameters_t modified_play[1];
    uint32_t drive_curves;
    hyst_curve_t drive_curve[1];
    uint32_t reference_curves;
    hyst_curve_t reference_curve[1];
    uint32_t shape_sections;
    hyst_iir_section_t shape[HYST_IIR_MAX_SECTIONS];
    uint32_t inertia_sections;
    hyst_iir_section_t inertia[HYST_INERTIA_MAX_SECTIONS];
    uint32_t equalise_sections;
    hyst_iir_section_t equalise[HYST_IIR_MAX_SECTIONS];
    uint32_t creep_cells;
    hyst_creep_cell_t creep[HYST_CREEP_MAX_CELLS];
} hyst_parameters_t;

/** Why an image is refused. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_PARAMETERS_OK = 0,
    HYST_PARAMETERS_BAD_LENGTH = 1, /**< shorter or longer than its own length word or its counts say */
    HYST_PARAMETERS_BAD_MAGIC = 2,
    HYST_PARAMETERS_BAD_VERSION = 3,
    HYST_PARAMETERS_BAD_CRC = 4,
    HYST_PARAMETERS_OUT_OF_RANGE = 5, /**< the field alone is out of its range */
    HYST_PARAMETERS_INCONSISTENT = 6, /**< the field contradicts another one */
    HYST_PARAMETERS_NOT_INVERTIBLE = 7,
    HYST_PARAMETERS_UNSTABLE = 8,
    HYST_PARAMETERS_TOO_COSTLY = 9, /**< the loop's worst case is longer than its period (cost.h) */
    HYST_PARAMETERS_ERROR_COUNT
} hyst_parameters_error_t;

/** The field a refusal points at. Values are part of the Modbus interface: append only. */
typedef enum {
    HYST_FIELD_NONE = 0,
    HYST_FIELD_WORDS,
    HYST_FIELD_MAGIC,
    HYST_FIELD_VERSION,
    HYST_FIELD_CRC,
    HYST_FIELD_SAMPLE_RATE,
    HYST_FIELD_DRIVE_HALF_RANGE,
    HYST_FIELD_POSITION_HALF_RANGE,
    HYST_FIELD_DRIVE_LOW,
    HYST_FIELD_DRIVE_HIGH,
    HYST_FIELD_DRIVE_PARK,
    HYST_FIELD_LINEAR_GAIN,
    HYST_FIELD_TRANSITION_SLEW,
    HYST_FIELD_LOOKAHEAD,
    HYST_FIELD_PI_OPERATORS,
    HYST_FIELD_PI_WEIGHT,
    HYST_FIELD_PI_THRESHOLD,
    HYST_FIELD_PI_BETA,
    HYST_FIELD_PI_RATE_GAIN,
    HYST_FIELD_SHAPE_SECTIONS,
    HYST_FIELD_SHAPE,
    HYST_FIELD_EQUALISE_SECTIONS,
    HYST_FIELD_EQUALISE,
    HYST_FIELD_CREEP_CELLS,
    HYST_FIELD_CREEP,
    HYST_FIELD_FAMILY,
    HYST_FIELD_PREISACH_INTERVALS,
    HYST_FIELD_PREISACH_EVERETT,
    HYST_FIELD_BOUC_WEN_CELLS,
    HYST_FIELD_BOUC_WEN_DIRECT,
    HYST_FIELD_BOUC_WEN_LENGTH,
    HYST_FIELD_BOUC_WEN_SLOPE,
    HYST_FIELD_MODIFIED_PLAYS,
    HYST_FIELD_MODIFIED_PLAY,
    HYST_FIELD_DRIVE_CURVES,
    HYST_FIELD_DRIVE_CURVE,
    HYST_FIELD_INERTIA_SECTIONS,
    HYST_FIELD_INERTIA,
    HYST_FIELD_REFERENCE_CURVES,
    HYST_FIELD_REFERENCE_CURVE,
    HYST_FIELD_COUNT
} hyst_field_t;

typedef struct {
    hyst_parameters_error_t error;
    hyst_field_t field;
    uint32_t element; /**< index within the field, 0 for a scalar */
} hyst_parameters_fault_t;

/** CRC-32 of `count` words as described above. */
uint32_t hyst_crc32(const uint32_t *words, size_t count);

/** Writes the image with its CRC. Returns its length in words, or 0 if the counts in *parameters are out of range or
 * capacity is too small. */
size_t hyst_parameters_encode(const hyst_parameters_t *parameters, uint32_t *words, size_t capacity);

/** Reads an image: length, magic, version, CRC, counts. On a fault *parameters is undefined. Follow with
 * hyst_parameters_build. */
hyst_parameters_fault_t hyst_parameters_decode(const uint32_t *words, size_t count, hyst_parameters_t *parameters);

/**
 * The validator: checks every field and builds the compensator from them. Refuses whatever is not invertible, out of
 * range or inconsistent. On a fault *compensator is undefined (build into the idle half of a double buffer).
 */
hyst_parameters_fault_t hyst_parameters_build(const hyst_parameters_t *parameters, hyst_compensator_t *compensator);

/** A safe set: drive range whole, parked in the middle, no hysteresis, gain 1, 10 kHz, scales of 1 V and 1 um. Always
 * valid. */
void hyst_parameters_default(hyst_parameters_t *parameters);

/** "out of range" etc. / the field's name as written above, for one-line messages. Never NULL. */
const char *hyst_parameters_error_text(hyst_parameters_error_t error);
const char *hyst_field_text(hyst_field_t field);

#endif
