/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What is behind the handles of hyst_interface.h, for the files that make it up. */
#ifndef HANDLES_H
#define HANDLES_H

#include "base/provenance.h"
#include "chain/model.h"
#include "interface/hyst_interface.h"
#include "recording/recording.h"

/* note: the files and the device that it was made from. */
struct hyst_host_recording {
    recording_t recording;
    provenance_note_t *note;
};

struct hyst_host_model {
    model_t model;
    provenance_note_t *note;
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

/** Copies of the recordings as an array, with drive and position at the same instants (chain/align.h); to be freed
 * with interface_recordings_free. NULL: a header key is wrong. */
recording_t *interface_recordings(const hyst_host_recording_t *const *recordings, size_t count);
void interface_recordings_free(recording_t *recordings, size_t count);

/** A note of what these (model may be NULL) were made from, and of a file (NULL: none). */
provenance_note_t *interface_note(const hyst_host_recording_t *const *recordings, size_t count,
                                  const hyst_host_model_t *model, const char *path);

/** A handle for a recording and a note, which it takes over. */
hyst_host_recording_t *interface_recording(const recording_t *recording, provenance_note_t *note);
/** The same of a model. */
hyst_host_model_t *interface_model(const model_t *model, provenance_note_t *note);

#endif
