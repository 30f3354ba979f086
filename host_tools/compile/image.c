/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The image file, its validation, and the scales it carries. */
#include "base/output_file.h"
#include "compile/compile.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static bool report_fault(hyst_parameters_fault_t fault, const char *where, failure_t *failure) {
    return fail(failure, "%s: refused: %s, element %u: %s", where, hyst_field_text(fault.field),
                (unsigned)fault.element, hyst_parameters_error_text(fault.error));
}

bool parameters_check(const hyst_parameters_t *parameters, const char *where, failure_t *failure) {
    hyst_compensator_t compensator;
    const hyst_parameters_fault_t fault = hyst_parameters_build(parameters, &compensator);
    return fault.error == HYST_PARAMETERS_OK || report_fault(fault, where, failure);
}

bool image_to_bytes(const hyst_parameters_t *parameters, unsigned char bytes[IMAGE_MOST_BYTES], size_t *length,
                    const char *where, failure_t *failure) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t count = hyst_parameters_encode(parameters, words, HYST_IMAGE_MAX_WORDS);
    if (count == 0) {
        return fail(failure, "%s: the parameters do not fit into an image", where);
    }
    *length = 4 * count;
    for (size_t i = 0; i < *length; i++) {
        bytes[i] = (unsigned char)(words[i / 4] >> (8 * (i % 4)) & 0xFFU);
    }
    return true;
}

bool image_from_bytes(hyst_parameters_t *parameters, const unsigned char *bytes, size_t length, const char *where,
                      failure_t *failure) {
    uint32_t words[HYST_IMAGE_MAX_WORDS] = {0};
    if (length == 0 || length > IMAGE_MOST_BYTES || length % 4 != 0) {
        return fail(failure, "%s: not a parameter image: %s%zu bytes, expected %u to %u in steps of 4", where,
                    length > IMAGE_MOST_BYTES ? "more than " : "",
                    length > IMAGE_MOST_BYTES ? (size_t)IMAGE_MOST_BYTES : length, 4U * HYST_IMAGE_MIN_WORDS,
                    (unsigned)IMAGE_MOST_BYTES);
    }
    for (size_t i = 0; i < length; i++) {
        words[i / 4] |= (uint32_t)bytes[i] << (8 * (i % 4));
    }
    const hyst_parameters_fault_t fault = hyst_parameters_decode(words, length / 4, parameters);
    if (fault.error != HYST_PARAMETERS_OK) {
        return report_fault(fault, where, failure);
    }
    return parameters_check(parameters, where, failure);
}

bool image_write(const hyst_parameters_t *parameters, const char *path, failure_t *failure) {
    unsigned char bytes[IMAGE_MOST_BYTES];
    size_t length = 0;
    output_file_t output;
    if (!image_to_bytes(parameters, bytes, &length, path, failure) || !output_file_open(&output, path, failure)) {
        return false;
    }
    (void)fwrite(bytes, 1, length, output.file); /* what the file does not take, closing it reports */
    return output_file_close(&output, true, failure);
}

bool image_read(hyst_parameters_t *parameters, const char *path, failure_t *failure) {
    unsigned char bytes[IMAGE_MOST_BYTES + 1];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return fail(failure, "%s: %s", path, strerror(errno));
    }
    const size_t length = fread(bytes, 1, sizeof bytes, file);
    const bool good = !ferror(file) || fail(failure, "%s: %s", path, strerror(errno));
    fclose(file);
    return good && image_from_bytes(parameters, bytes, length, path, failure);
}

static double from_q31(hyst_q31_t fraction, int32_t center, int32_t half_range) {
    return 1e-6 * ((double)center + (double)half_range * ((double)fraction * 0x1p-31));
}

static hyst_q31_t to_q31(double value, int32_t center, int32_t half_range) {
    const double fraction = (1e6 * value - (double)center) / (double)half_range;
    return (hyst_q31_t)fmax(-0x1p31, fmin(floor(fraction * 0x1p31 + 0.5), 0x1p31 - 1.0));
}

double drive_to_volts(const hyst_parameters_t *parameters, hyst_q31_t drive) {
    return from_q31(drive, parameters->drive_center_uv, parameters->drive_half_range_uv);
}

double position_to_micrometres(const hyst_parameters_t *parameters, hyst_q31_t position) {
    return from_q31(position, parameters->position_center_pm, parameters->position_half_range_pm);
}

hyst_q31_t drive_from_volts(const hyst_parameters_t *parameters, double volts) {
    return to_q31(volts, parameters->drive_center_uv, parameters->drive_half_range_uv);
}

hyst_q31_t position_from_micrometres(const hyst_parameters_t *parameters, double micrometres) {
    return to_q31(micrometres, parameters->position_center_pm, parameters->position_half_range_pm);
}

double reference_for(const hyst_parameters_t *parameters, double position) {
    bool saturated;
    return parameters->reference_curves == 0
               ? position
               : 0x1p-31 * hyst_curve_solve(parameters->reference_curve, hyst_saturate(llround(position * 0x1p31)),
                                            &saturated);
}
