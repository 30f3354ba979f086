/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Register `sequence` has 32 bits: at 10 kHz it wraps after 4.97 days. */
#ifndef SAMPLE_NUMBER_H
#define SAMPLE_NUMBER_H

#include <stdint.h>

/** Samples from the number `then` to the number `now`, of two readings less than 2^31 samples apart. Below 0: the
 * amplifier has restarted between them, and counts from 0 again. */
static inline int64_t samples_between(int64_t then, int64_t now) {
    return (int32_t)((uint32_t)now - (uint32_t)then);
}

#endif
