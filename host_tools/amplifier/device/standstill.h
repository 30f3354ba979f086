/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Notices when the amplifier's loop makes no samples any more, as where its converters, or its twin, do not run. */
#ifndef STANDSTILL_H
#define STANDSTILL_H

#include "base/failure.h"
#include <stdint.h>

typedef struct {
    int64_t sample; /**< number of the newest one that was seen */
    double since_s; /**< when it was first seen, by monotonic_s */
} standstill_t;

/** From this sample on. */
standstill_t standstill_begin(int64_t sample);

/** With the number of the newest sample: fails when it has been the same for 5 s. */
bool standstill_check(standstill_t *standstill, int64_t sample, failure_t *failure);

#endif
