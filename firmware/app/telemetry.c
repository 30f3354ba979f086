/* SPDX-License-Identifier: MIT */
#include "telemetry.h"
#include <stdatomic.h>

/*
 * A sequence lock: the version is odd while the sample is being written, and the reader tries again when it changed.
 * One core, and the writer is an interrupt of the reader: the reader never sees an odd version, and tries again at most
 * once per sample interrupt. Fences against the compiler are enough here; full ones cost nothing that matters.
 */
static atomic_uint version;
static telemetry_t published;

void telemetry_publish(const telemetry_t *sample) {
    const unsigned before = atomic_load_explicit(&version, memory_order_relaxed);
    atomic_store_explicit(&version, before + 1U, memory_order_relaxed);
    atomic_thread_fence(memory_order_release);
    published = *sample;
    atomic_store_explicit(&version, before + 2U, memory_order_release);
}

void telemetry_read(telemetry_t *sample) {
    unsigned before, after;
    do {
        before = atomic_load_explicit(&version, memory_order_acquire);
        *sample = published;
        atomic_thread_fence(memory_order_acquire);
        after = atomic_load_explicit(&version, memory_order_relaxed);
    } while (before != after || before % 2U != 0);
}
