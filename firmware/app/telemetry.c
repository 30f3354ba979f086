/* SPDX-License-Identifier: MIT */
#include "telemetry.h"
#include <stdatomic.h>

/*
 * The sample is read where the interrupt writes it. One core, and the writer is an interrupt of the reader: the reader
 * never sees a sample half written, but may be interrupted half-way through its copy. Then the version has changed, and
 * it tries again, at most once per sample interrupt. Fences against the compiler are enough here; full ones cost
 * nothing that matters.
 */
static atomic_uint version;
static const telemetry_t *_Atomic published;

void telemetry_publish(const telemetry_t *sample) {
    atomic_store_explicit(&published, sample, memory_order_relaxed);
    const unsigned before = atomic_load_explicit(&version, memory_order_relaxed);
    atomic_signal_fence(memory_order_release);
    atomic_store_explicit(&version, before + 1U, memory_order_relaxed);
}

void telemetry_read(telemetry_t *sample) {
    unsigned before, after;
    do {
        before = atomic_load_explicit(&version, memory_order_acquire);
        *sample = *atomic_load_explicit(&published, memory_order_relaxed);
        atomic_thread_fence(memory_order_acquire);
        after = atomic_load_explicit(&version, memory_order_relaxed);
    } while (before != after);
}
