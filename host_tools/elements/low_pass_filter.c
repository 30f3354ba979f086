/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "elements/low_pass_filter.h"

const parameter_info_t low_pass_filter_parameters[LOW_PASS_FILTER_PARAMETERS] = {
    {.name = "frequency_hz",
     .unit = "Hz",
     .low = 1e-3,
     .high = 1e9,
     .text = "where the phase is -90 degrees; of a Butterworth filter the cutoff (-3 dB)"},
    {.name = "damping_ratio",
     .unit = "1",
     .low = 0.2,
     .high = 0.999,
     .text = "of critical damping: 0.707 Butterworth, 0.866 Bessel"}};

bool low_pass_filter_probe(const probe_setting_t *setting, size_t index, double *value) {
    value[1] = 0.7;
    return probe_between(setting->sample_rate_hz / 4.0, 4.0 / setting->longest_s, 8, index, value);
}

bool low_pass_filter_rings(const probe_seen_t *seen, const double *value) {
    return probe_saw_ring(seen, value[0]);
}
