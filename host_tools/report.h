/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The tracking report: what the compensator gained, or what a diagnosis gained it, on one self-contained HTML page
 * (inline SVG, no script, no network, light, dark and paper), and the same numbers as text and JSON.
 */
#ifndef REPORT_H
#define REPORT_H

#include "chain.h"
#include "error_budget.h"

/** One reference, tracked twice. */
typedef struct {
    const char *name;
    recording_t before, after; /**< with a reference column; what they are: report_words */
    double peak_to_peak_um;    /**< of the reference */
    error_measure_t error_before, error_after;
    error_budget_t remaining; /**< of the compensated track */
} report_track_t;

typedef struct {
    const model_t *model;         /**< what the amplifier knows */
    const recording_t *recording; /**< what the model was fitted to */
    const char *simulated;        /**< how the tracks were simulated; NULL when nothing is known about that */
    json_t *diagnosis;            /**< "hyst-diagnosis-1" that lies between before and after, or NULL */
    report_track_t *track;
    size_t tracks;
} report_t;

/** Reads both tracks and measures them. `name` must outlive *track. On failure nothing needs to be freed. */
bool report_track_read(report_track_t *track, const char *name, const char *before, const char *after,
                       failure_t *failure);
void report_track_free(report_track_t *track);

/** How before and after are called. */
typedef struct {
    const char *title, *no_help; /**< of the page; when some track did not gain */
    const char *before, *after;  /**< in a legend */
    const char *what_they_are;   /**< sentences */
} report_words_t;

/** Without a diagnosis: linear drive and compensated. With one: compensated by the first model, and by the one that the
 * diagnosis made of it. */
const report_words_t *report_words(const report_t *report);

/** Reads what `hyst diagnose --json` wrote; to be freed with json_decref. NULL on failure. */
json_t *report_diagnosis_read(const char *path, failure_t *failure);

/** Error before over error after. */
double report_gain(const report_track_t *track);
/** The track that gains least. tracks > 0. */
const report_track_t *report_worst(const report_t *report);

/** tracks > 0. Simulates the model over its recording, which is what can fail besides writing. */
bool report_write_html(const report_t *report, const char *path, failure_t *failure);

/** The error traces of all tracks as one SVG document. */
bool report_write_picture(const report_t *report, const char *path, failure_t *failure);

/** The table of the tracks on stdout. */
void report_print(const report_t *report);

/** {"format": "hyst-tracking-1", "tracks": [{"name":, "before_nrmse_percent":, "after_nrmse_percent":, ...}]}. A new
 * reference. */
json_t *report_to_json(const report_t *report);

#endif
