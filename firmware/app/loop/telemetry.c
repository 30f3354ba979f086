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

void telemetry_publish(const telemetry_t *sample) {
    atomic_store_explicit(&published, sample, memory_order_relaxed);
}

void telemetry_read(telemetry_t *sample) {
    const telemetry_t *from = atomic_load_explicit(&published, memory_order_relaxed);
    const volatile uint32_t *version = &from->sequence;
    uint32_t before;
    do {
        before = *version;
        atomic_signal_fence(memory_order_acquire);
        *sample = *from;
        sample->capture_state = capture_state();
        sample->capture_frames = capture_frames();
        atomic_signal_fence(memory_order_acquire);
    } while (before != *version);
}
