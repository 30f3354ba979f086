/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What is behind the handles of hyst_interface.h, for the files that make it up. */
#ifndef HANDLES_H
#define HANDLES_H

#include "chain/model.h"
#include "interface/hyst_interface.h"
#include "recording/recording.h"

struct hyst_host_recording {
    recording_t recording;
};

struct hyst_host_model {
    model_t model;
};

/** The line of this thread, for functions that fill one. */
failure_t *interface_failure(void);

/**
 * Reads options, as json_unpack does with JSON_STRICT: every value is optional ("s?F"), none may be left over. The
 * texts that it finds belong to the returned object, a new reference. NULL: the line says what is wrong.
 */
json_t *interface_options(const char *options, const char *format, ...);

/** A text of the caller's own; drops the reference. */
char *interface_text(json_t *json);

/** Shallow copies of the recordings, for functions that want an array; to be freed. */
recording_t *interface_recordings(const hyst_host_recording_t *const *recordings, size_t count);

/** A handle for a recording, which it takes over. */
hyst_host_recording_t *interface_recording(const recording_t *recording);

#endif
