/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "chain/probe.h"
#include <math.h>
#include <string.h>

bool probe_between(double low, double high, size_t count, size_t index, double *value) {
    *value = low * pow(high / low, (double)index / (double)(count - 1));
    return index < count;
}

double probe_join_level(const probe_setting_t *setting, const double *value, size_t parameter) {
    (void)value;
    (void)parameter;
    return 0.5 * (setting->displacement_low_um + setting->displacement_high_um);
}

bool probe_saw_ring(const probe_seen_t *seen, double frequency_hz) {
    return seen->rings > 0 && frequency_hz > 0.0 && fabs(log(frequency_hz / seen->ring_hz)) < seen->ring_near;
}

bool probe_may_replace(const probe_t *probe, const char *group) {
    const char *const *of = probe->in_place_of;
    return (of[0] != NULL && strcmp(of[0], group) == 0) || (of[1] != NULL && strcmp(of[1], group) == 0);
}
