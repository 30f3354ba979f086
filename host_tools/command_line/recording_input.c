/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/recording_input.h"
#include "chain/align.h"
#include "command_line/print.h"
#include "look/summary.h"
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

bool read_recording_aloud(recording_t *recording, const char *path, failure_t *failure) {
    if (!recording_read(recording, path, failure)) {
        return false;
    }
    if (!recording_align(recording, failure)) {
        recording_free(recording);
        return false;
    }
    if (recording->understood != NULL) {
        summary_t holds;
        failure_t too_short;
        fputs(recording->understood, stderr);
        if (summary_make(recording, &holds, &too_short)) {
            summary_print(stderr, &holds);
        }
    }
    return true;
}

recording_t *read_recordings_aloud(char *const *paths, size_t count, failure_t *failure) {
    return read_spans_aloud(paths, count, &SPAN_WHOLE, failure);
}

/* Two samples of one measurement are no two measurements: standard errors come out too small. */
static void note_repeated(char *const *paths, size_t count) {
    struct stat *file = allocate(count, sizeof *file);
    for (size_t i = 0; i < count; i++) {
        const bool known = stat(paths[i], &file[i]) == 0 && S_ISREG(file[i].st_mode);
        for (size_t k = 0; known && k < i; k++) {
            if (file[k].st_dev == file[i].st_dev && file[k].st_ino == file[i].st_ino) {
                fprintf(stderr, "note: %s is the same file as %s and counts once more\n", paths[i], paths[k]);
                break;
            }
        }
    }
    free(file);
}

recording_t *read_spans_aloud(char *const *paths, size_t count, const span_t *span, failure_t *failure) {
    recording_t *recordings = allocate(count, sizeof *recordings);
    size_t bad = 0;
    for (size_t i = 0; i < count; i++) { /* one that is bad is cleared, and the others are tried all the same */
        failure_t of_one;
        if (!read_recording_aloud(&recordings[i], paths[i], &of_one) ||
            !recording_span(&recordings[i], span->from_s, span->to_s, &of_one)) {
            recording_free(&recordings[i]);
            if (bad++ > 0) {
                (void)failure_print(failure);
            }
            *failure = of_one;
        }
    }
    if (bad > 0) {
        recordings_free(recordings, count);
        return NULL;
    }
    note_repeated(paths, count);
    return recordings;
}

void recordings_free(recording_t *recordings, size_t count) {
    for (size_t i = 0; recordings != NULL && i < count; i++) {
        recording_free(&recordings[i]);
    }
    free(recordings);
}
