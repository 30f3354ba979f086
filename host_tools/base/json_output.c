/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "base/output_file.h"
#include <math.h>

json_t *json_number_or_null(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

bool json_write(json_t *value, const char *path, failure_t *failure) {
    output_file_t output;
    bool written = output_file_open(&output, path, failure);
    if (written) {
        /* jansson does not say why; what the file does not take, closing it reports. */
        const bool dumped = json_dumpf(value, output.file, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) == 0;
        const bool good = dumped || ferror(output.file) != 0 || fail(failure, "%s: nothing that JSON can hold", path);
        written = output_file_close(&output, good, failure);
    }
    json_decref(value);
    return written;
}
