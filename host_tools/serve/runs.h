/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the page can have the amplifier do: record, track, push an image, clear a fault. */
#ifndef RUNS_H
#define RUNS_H

#include "amplifier/driving.h"
#include "amplifier/experiment.h"
#include "recording/reserved_output.h"
#include "serve/line_keeper.h"
#include <jansson.h>

/** Length of a path in bytes, with its end. */
#define RUNS_PATH 4096

typedef enum { RUN_RECORD, RUN_TRACK, RUN_PUSH, RUN_CLEAR } run_kind_t;

typedef struct {
    run_kind_t kind;
    waveform_options_t waveform; /**< its name is waveform_name */
    char waveform_name[32];
    char probe[64]; /**< a block's name, or "all"; empty: the waveform */
    bool condition;
    double drive_range_v[2], position_range_um[2]; /**< both 0: the image's */
    bool before, after;                            /**< track linear, and compensated */
    unsigned long frames;
    /** The image to push; the recording to write; with two tracks that before and that after. */
    char path[2][RUNS_PATH];
    reserved_output_t file[2]; /**< of these, while it runs */
    driving_fault_t left;      /**< afterwards: what a recording or a track led the amplifier out of */
    json_t *result;            /**< afterwards: what the page shows; to be dropped */
} run_request_t;

/** Reads the settings of a message {"do": "record" ...}, but no names of files. */
bool run_request_read(json_t *message, run_request_t *request, failure_t *failure);

/** Work for the line keeper (line_work_t). context: the request. */
bool run_request_carry_out(line_keeper_t *keeper, device_t *device, void *context, failure_t *failure);

#endif
