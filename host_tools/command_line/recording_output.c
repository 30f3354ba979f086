/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/recording_output.h"
#include "recording/recording_hdf5.h"

enum { MOST_LISTED = 10 };

void extras_print(FILE *stream, const recording_t *recording, const char *path) {
    const bool kept = hdf5_is_named(path);
    if (recording->extras == 0) {
        return;
    }
    (void)fprintf(stream, "  %s",
                  kept ? "kept beside them: " : "not kept, as it is CSV (a name that ends in .h5 is): ");
    for (size_t i = 0; i < recording->extras && i < MOST_LISTED; i++) {
        const recording_extra_t *extra = &recording->extra[i];
        (void)fprintf(stream, "%s%s", i > 0 ? ", " : "", extra->name);
        if (extra->unit[0] != '\0') {
            (void)fprintf(stream, " (%s)", extra->unit);
        }
    }
    if (recording->extras > MOST_LISTED) {
        (void)fprintf(stream, " and %zu more", recording->extras - MOST_LISTED);
    }
    (void)fputc('\n', stream);
}

json_t *extras_to_json(const recording_t *recording, const char *path) {
    json_t *kept = json_array();
    for (size_t i = 0; hdf5_is_named(path) && i < recording->extras; i++) {
        const recording_extra_t *extra = &recording->extra[i];
        const char *long_name = extra->long_name[0] != '\0' ? extra->long_name : extra->name;
        json_array_append_new(
            kept, json_pack("{s:s, s:s, s:s}", "name", extra->name, "long_name", long_name, "unit", extra->unit));
    }
    return kept;
}
