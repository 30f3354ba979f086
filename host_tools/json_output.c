/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "json_output.h"
#include <math.h>
#include <stdio.h>

json_t *json_number_or_null(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

bool json_print(json_t *value, size_t flags, failure_t *failure) {
    const bool written =
        value != NULL && json_dumpf(value, stdout, flags) == 0 && putchar('\n') != EOF && fflush(stdout) == 0;
    json_decref(value);
    return written || fail(failure, "cannot write the result to stdout");
}

bool json_write(json_t *value, const char *path, failure_t *failure) {
    const bool written = json_dump_file(value, path, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) == 0;
    json_decref(value);
    return written || fail(failure, "%s: could not be written", path);
}
