/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/sampling_note.h"
#include <stdio.h>

void sampling_note(device_t *device, int64_t decimation, recording_t *recording) {
    int64_t after_ns;
    char text[32];
    failure_t ignored;
    if (decimation > 1) {
        (void)snprintf(text, sizeof text, "%.9g", 1.0 / device_sample_rate_hz(device));
        recording_set_key(recording, "drive_step_s", text);
    } else if (device_read(device, INDEX_sampled_after, &after_ns, &ignored)) {
        (void)snprintf(text, sizeof text, "%.9g", 1e-9 * (double)after_ns);
        recording_set_key(recording, "drive_between_samples", drive_between_name(BETWEEN_HELD));
        recording_set_key(recording, "displacement_sampled_after_s", text);
    }
}
