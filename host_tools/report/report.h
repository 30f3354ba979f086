/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The tracking report: the gain by the compensator, or by a diagnosis on top of it, on one self-contained HTML page
 * (inline SVG, one inline script, no network, light, dark and paper), and the same numbers as text and JSON.
 */
#ifndef REPORT_H
#define REPORT_H

#include "chain/chain.h"
#include "report/error_budget.h"
#include <stdio.h>

/** One reference, tracked twice. */
typedef struct {
    const char *name;
    recording_t before, after; /**< with a reference column; report_words says what they are */
    double peak_to_peak_um;    /**< of the reference */
    error_measure_t error_before, error_after;
    error_budget_t remaining; /**< of the compensated track */
} report_track_t;

typedef struct {
    const model_t *model;         /**< the one in the amplifier */
    const recording_t *recording; /**< that the model was fitted to */
    const char *simulated;        /**< how the tracks were simulated; NULL when nothing is known about that */
    json_t *diagnosis;            /**< "hyst-diagnosis-1" made between before and after, or NULL */
    report_track_t *track;
    size_t tracks;
} report_t;

/** Reads both tracks and measures them. `name` must outlive *track. On failure nothing needs to be freed. */
bool report_track_read(report_track_t *track, const char *name, const char *before, const char *after,
                       failure_t *failure);
void report_track_free(report_track_t *track);
/** Refuses tracks whose headers say that they were made in another mode than the page would say. */
bool report_check_modes(const report_t *report, failure_t *failure);

/** How before and after are called. */
typedef struct {
    const char *title, *no_help; /**< of the page; where a track did not improve */
    const char *before, *after;  /**< in a legend */
    const char *what_they_are;   /**< sentences */
} report_words_t;

/** Without a diagnosis: linear drive and compensated. With one: compensated by the first model, and by the extended
 * one. */
const report_words_t *report_words(const report_t *report);

/** Reads what `hyst diagnose --json` wrote; to be freed with json_decref. NULL on failure. */
json_t *report_diagnosis_read(const char *path, failure_t *failure);

/** Error before over error after. */
double report_gain(const report_track_t *track);
/** The track that improves least. tracks > 0. */
const report_track_t *report_worst(const report_t *report);

/** tracks > 0. Simulates the model over its recording; that or the writing can fail. */
bool report_write_html(const report_t *report, const char *path, failure_t *failure);

/** The error traces of all tracks as one SVG document. */
bool report_write_picture(const report_t *report, const char *path, failure_t *failure);

/** The table of the tracks. */
void report_print(FILE *file, const report_t *report);

/** {"format": "hyst-tracking-1", "tracks": [{"name":, "before_nrmse_percent":, "after_nrmse_percent":, ...}]}. A new
 * reference. */
json_t *report_to_json(const report_t *report);

#endif
