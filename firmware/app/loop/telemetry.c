/* SPDX-License-Identifier: MIT */
#include "loop/telemetry.h"
#include "loop/capture.h"
#include <stdatomic.h>

/*
 * The sample is read where the interrupt writes it. One core, and the writer is an interrupt of the reader: the reader
 * never sees a sample half written, but may be interrupted half-way through its copy. Then the sequence number has
 * changed, and it tries again, at most once per sample interrupt. Fences against the compiler are enough.
 */
static const telemetry_t *_Atomic published;
static const limit_counts_t *_Atomic published_limits;

void telemetry_publish(const telemetry_t *sample, const limit_counts_t *limits) {
    atomic_store_explicit(&published, sample, memory_order_relaxed);
    atomic_store_explicit(&published_limits, limits, memory_order_relaxed);
}

/* Samples with any of these limits. */
static uint32_t samples_with(const limit_counts_t *limits, uint32_t which) {
    uint64_t sum = 0;
    for (uint32_t set = 0; set < LIMIT_SETS; set++) {
        sum += (set & which) != 0 ? limits->samples[set] : 0;
    }
    return sum < UINT32_MAX ? (uint32_t)sum : UINT32_MAX;
}

static void add_up(const limit_counts_t *limits, telemetry_t *sample) {
    uint64_t samples = 0;
    uint32_t seen = 0;
    for (uint32_t set = 0; set < LIMIT_SETS; set++) {
        samples += limits->samples[set];
        seen |= limits->samples[set] > 0 ? set : 0;
    }
    sample->samples = samples < UINT32_MAX ? (uint32_t)samples : UINT32_MAX;
    sample->limits_sticky = seen;
    sample->drive_limited = samples_with(limits, LIMIT_DRIVE);
    sample->unreachable = samples_with(limits, LIMIT_UNREACHABLE);
    sample->filter_saturated = samples_with(limits, LIMIT_FILTER);
    sample->slew_limited = samples_with(limits, LIMIT_SLEW);
    sample->reference_limited = samples_with(limits, LIMIT_REFERENCE);
}

void telemetry_read(telemetry_t *sample) {
    const telemetry_t *from = atomic_load_explicit(&published, memory_order_relaxed);
    const limit_counts_t *from_limits = atomic_load_explicit(&published_limits, memory_order_relaxed);
    const volatile uint32_t *version = &from->sequence;
    limit_counts_t limits;
    uint32_t before;
    do {
        before = *version;
        atomic_signal_fence(memory_order_acquire);
        *sample = *from;
        limits = *from_limits;
        sample->capture_state = capture_state();
        sample->capture_frames = capture_frames();
        atomic_signal_fence(memory_order_acquire);
    } while (before != *version);
    add_up(&limits, sample);
}
