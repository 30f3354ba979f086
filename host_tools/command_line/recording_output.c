/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/recording_output.h"
#include "recording/recording_hdf5.h"

enum { MOST_LISTED = 10 };

static size_t extras_kept(const recording_t *recording, const char *path) {
    return hdf5_is_named(path) || recording->extras < RECORDING_CSV_EXTRAS ? recording->extras : RECORDING_CSV_EXTRAS;
}

void extras_print(FILE *stream, const recording_t *recording, const char *path) {
    const size_t kept = extras_kept(recording, path);
    if (kept == 0) {
        return;
    }
    (void)fputs("  kept beside them: ", stream);
    for (size_t i = 0; i < kept && i < MOST_LISTED; i++) {
        const recording_extra_t *extra = &recording->extra[i];
        (void)fprintf(stream, "%s%s", i > 0 ? ", " : "", extra->name);
        if (extra->unit[0] != '\0') {
            (void)fprintf(stream, " (%s)", extra->unit);
        }
    }
    if (kept > MOST_LISTED) {
        (void)fprintf(stream, " and %zu more", kept - MOST_LISTED);
    }
    (void)fputc('\n', stream);
    if (kept < recording->extras) {
        (void)fprintf(stream,
                      "  not kept: the last %zu of them; a CSV has %d, and HDF5 (a name that ends in .h5) all\n",
                      recording->extras - kept, RECORDING_CSV_EXTRAS);
    }
}

json_t *extras_to_json(const recording_t *recording, const char *path) {
    json_t *kept = json_array();
    for (size_t i = 0; i < extras_kept(recording, path); i++) {
        const recording_extra_t *extra = &recording->extra[i];
        const char *long_name = extra->long_name[0] != '\0' ? extra->long_name : extra->name;
        json_array_append_new(
            kept, json_pack("{s:s, s:s, s:s}", "name", extra->name, "long_name", long_name, "unit", extra->unit));
    }
    return kept;
}
