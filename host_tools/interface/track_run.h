/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Following a reference on the amplifier, and the error, as `hyst track` does it. */
#ifndef TRACK_RUN_H
#define TRACK_RUN_H

#include "amplifier/experiment.h"
#include "chain/chain.h"
#include "report/error_budget.h"

/** One run in one mode. */
typedef struct {
    hyst_mode_t mode;
    recording_t recording;
    experiment_events_t events;
    double peak_to_peak_um; /**< of the reference */
    error_measure_t error;
    error_budget_t budget;
} track_t;

enum { TRACK_MOST = 2 };

/** Called after each run, while it is still guarded: when it returns false, the amplifier is parked. As
 * record_take_t. */
typedef bool track_take_t(void *context, const track_t *track, failure_t *failure);

typedef struct {
    waveform_options_t waveform;
    size_t count; /**< of modes, 1 or 2 */
    hyst_mode_t mode[TRACK_MOST];
    bool no_condition;
    unsigned long frames;              /**< rows at most; 0: as many as the amplifier holds */
    const volatile sig_atomic_t *stop; /**< as of driving_run; NULL: signals */
    track_take_t *take;                /**< NULL: none */
    void *context;
} track_options_t;

/** Runs it in each mode. *usage: it is the options that are at fault. On success the caller frees the tracks. */
bool track_run(device_t *device, const track_options_t *options, waveform_t *waveform, track_t track[TRACK_MOST],
               bool *usage, failure_t *failure);
void tracks_free(track_t *track, size_t count);

/** The counters of a run, by name: a new reference. */
json_t *events_to_json(const experiment_events_t *events);

/** NRMSE before over NRMSE after. */
double track_ratio(const track_t *before, const track_t *after);

/** What `hyst track --json` prints: a new reference. */
json_t *tracks_to_json(const track_t *track, size_t count, const waveform_t *waveform);

#endif
