/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/search/windows.h"
#include "diagnosis/question/excerpt.h"
#include <stdlib.h>

static bool take_window(const recording_t *recording, size_t most, recording_t *window) {
    size_t first = 0;
    const bool good = recording->samples <= most || excerpt_window(recording, most, &first);
    recording_copy(window, recording, first, recording->samples < most ? recording->samples : most);
    return good;
}

static void free_recordings(windows_t *windows) {
    for (size_t i = 0; i < windows->count; i++) {
        recording_free(&windows->recordings[i]);
    }
    free(windows->recordings);
    windows->recordings = NULL;
    windows->count = 0;
}

void windows_open(windows_t *windows, const samples_t *samples, const model_t *model, size_t most) {
    failure_t refusal;
    bool good = samples->all > most;
    *windows = (windows_t){.samples = samples, .recordings = allocate(samples->count, sizeof(recording_t))};
    while (good && windows->count < samples->count) {
        good = take_window(&samples->recordings[windows->count], most / samples->count,
                           &windows->recordings[windows->count]);
        windows->count++;
    }
    if (!good || !samples_open(&windows->windowed, model, windows->recordings, windows->count, &refusal)) {
        free_recordings(windows);
        return;
    }
    const samples_t shared = samples_share_ends(&windows->windowed);
    free(windows->windowed.part);
    windows->windowed = shared;
    windows->samples = &windows->windowed;
}

void windows_close(windows_t *windows) {
    if (windows->count > 0) {
        samples_close(&windows->windowed);
    }
    free_recordings(windows);
}
