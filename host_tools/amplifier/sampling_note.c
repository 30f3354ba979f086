/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/sampling_note.h"
#include <stdio.h>

void sampling_note(device_t *device, int64_t decimation, recording_t *recording) {
    int64_t after_ns;
    char text[32];
    failure_t ignored;
    if (!device_read(device, INDEX_sampled_after, &after_ns, &ignored)) {
        return;
    }
    const double held_s = decimation > 1 ? 0.5 / device_sample_rate_hz(device) : 0.0;
    (void)snprintf(text, sizeof text, "%.9g", 1e-9 * (double)after_ns - held_s);
    recording_set_key(recording, "displacement_sampled_after_s", text);
    if (recording->column[COLUMN_REFERENCE] != NULL) { /* what the position of the row should be */
        recording_set_key(recording, "reference_sampled_with", "displacement");
    }
    if (decimation == 1) {
        recording_set_key(recording, "drive_between_samples", "held");
    }
}
