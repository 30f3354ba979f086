/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/device/standstill.h"
#include "base/monotonic_clock.h"
#include <inttypes.h>

/* A loop without a sample for this long counts as stopped. */
#define STANDSTILL_S 5.0

standstill_t standstill_begin(int64_t sample) {
    return (standstill_t){.sample = sample, .since_s = monotonic_s()};
}

bool standstill_check(standstill_t *standstill, int64_t sample, failure_t *failure) {
    if (sample != standstill->sample) {
        *standstill = standstill_begin(sample);
        return true;
    }
    return monotonic_s() - standstill->since_s <= STANDSTILL_S ||
           fail(failure,
                "the amplifier's loop stands still at sample %" PRId64 ": do its converters, or its twin, run?",
                sample);
}
