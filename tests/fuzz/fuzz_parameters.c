/* SPDX-License-Identifier: MIT */
/*
 * A valid parameter image with some words changed: the first byte is the number of operators, then come pairs of a
 * word's index and its new value. The CRC is made right, so that the image reaches the validator. One that is accepted
 * must run: in every mode, over the whole range, the drive stays within its limits.
 */
#include "hyst/parameters.h"
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(bool truth) {
    if (!truth) {
        abort();
    }
}

static void run(const hyst_compensator_t *compensator) {
    static const hyst_q31_t references[] = {0, INT32_MAX, INT32_MIN, 1, -1, 1 << 30, -(1 << 30)};
    hyst_compensator_state_t state;
    hyst_compensator_reset(compensator, &state);
    for (int mode = HYST_MODE_PARK; mode <= HYST_MODE_COMPENSATE; mode++) {
        for (unsigned i = 0; i < 70; i++) {
            unsigned events;
            const hyst_q31_t drive =
                hyst_compensator_step(compensator, &state, (hyst_mode_t)mode, references[i / 3 % 7], &events);
            require(drive >= compensator->drive_low && drive <= compensator->drive_high);
        }
    }
    while (!hyst_compensator_adopt(compensator, compensator, &state)) {
    }
}

static size_t valid_image(uint8_t operators, uint32_t words[HYST_IMAGE_MAX_WORDS]) {
    hyst_parameters_t p;
    hyst_parameters_default(&p);
    p.pi_operators = operators;
    for (int32_t i = 0; i < operators; i++) {
        p.pi_threshold[i] = (i + 1) << 22;
        p.pi_weight[i + 1] = HYST_Q28_ONE / 256;
    }
    p.shape_sections = p.equalise_sections = operators % (HYST_IIR_MAX_SECTIONS + 1U);
    for (uint32_t i = 0; i < p.shape_sections; i++) {
        p.shape[i] = p.equalise[i] = (hyst_iir_section_t){.b0 = HYST_Q28_ONE};
    }
    p.drive_curves = p.reference_curves = operators / 5U % 2U;
    hyst_curve_identity(p.drive_curve);
    hyst_curve_identity(p.reference_curve);
    return hyst_parameters_encode(&p, words, HYST_IMAGE_MAX_WORDS);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static hyst_parameters_t parameters;
    static hyst_compensator_t compensator;
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    if (size == 0) {
        return 0;
    }
    const size_t count = valid_image(data[0], words);
    uint16_t index;
    uint32_t value;
    for (size_t at = 1; at + sizeof index + sizeof value <= size; at += sizeof index + sizeof value) {
        memcpy(&index, data + at, sizeof index);
        memcpy(&value, data + at + sizeof index, sizeof value);
        words[index % count] = value;
    }
    words[count - 1U] = hyst_crc32(words, count - 1U);
    if (hyst_parameters_decode(words, count, &parameters).error == HYST_PARAMETERS_OK &&
        hyst_parameters_build(&parameters, &compensator).error == HYST_PARAMETERS_OK) {
        run(&compensator);
    }
    return 0;
}
