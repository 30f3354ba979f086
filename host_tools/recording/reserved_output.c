/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/reserved_output.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of a CSV, which is the larger kind: time, drive, displacement and reference, each at most 24 characters and what
 * separates it; and of a header, whose keys are some 20 short lines. */
#define ROW_BYTES    ((size_t)(4 * 25))
#define HEADER_BYTES ((size_t)4096)

bool reserved_output_open(reserved_output_t *output, const char *path, size_t rows, failure_t *failure) {
    failure_t why;
    *output = (reserved_output_t){.path = path};
    const size_t bytes = HEADER_BYTES + rows * ROW_BYTES;
    return path == NULL || output_room_take(&output->room, path, bytes, &why) ||
           fail(failure, "%s: no room for a recording of up to %zu rows (%.1f MB): %s", path, rows,
                1e-6 * (double)bytes, why.text);
}

void reserved_output_close(reserved_output_t *output) {
    output_room_release(&output->room);
}

/* Of what is no file (a pipe, a device) the name says nothing. */
static const char *last_part(const char *path) {
    const char *const slash = strrchr(path, '/');
    const bool no_file = strncmp(path, "/dev/", 5) == 0 || strncmp(path, "/proc/", 6) == 0;
    return no_file ? "recording.csv" : slash != NULL ? slash + 1 : path;
}

enum { ELSEWHERE = 400 };

/* Under the same name, in a folder that is new: there it replaces nothing. */
static bool write_elsewhere(const recording_t *recording, const char *path, char place[ELSEWHERE], failure_t *failure) {
    const char *const set = getenv("TMPDIR");
    char folder[ELSEWHERE / 2];
    const int length = snprintf(folder, sizeof folder, "%s/hyst-XXXXXX", set != NULL && set[0] != '\0' ? set : "/tmp");
    if (length >= (int)sizeof folder || mkdtemp(folder) == NULL) {
        return fail(failure, "%s: %s", folder, strerror(errno));
    }
    (void)snprintf(place, ELSEWHERE, "%s/%s", folder, last_part(path));
    return recording_write(recording, place, failure);
}

bool reserved_output_write(reserved_output_t *output, const recording_t *recording, failure_t *failure) {
    char place[ELSEWHERE];
    failure_t why, nor;
    if (output->path == NULL) {
        return true;
    }
    output_room_release(&output->room);
    if (recording_write(recording, output->path, &why)) {
        return true;
    }
    return write_elsewhere(recording, output->path, place, &nor)
               ? fail(failure, "%.500s; what was recorded is in %s", why.text, place)
               : fail(failure, "%.500s; what was recorded is lost, as there is no other place: %.350s", why.text,
                      nor.text);
}
