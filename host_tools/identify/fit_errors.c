/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/fit_errors.h"
#include "identify/refine.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Two numbers whose errors are correlated like this are known ten times better in one combination than one by one. */
static const double close_correlation = 0.99;

/* An optional parameter at its default was not fitted. */
static bool found(const parameter_info_t *info, const parameter_t *parameter) {
    return !info->chosen &&
           !(info->optional && !info->array && parameter->value[0] == info->default_value && parameter->sigma == NULL);
}

/* The numbers that were found and do not rest on a bound, in *unknown unless it is NULL. Elements of exactly 0 rest on
 * a bound of the family's. *open: some have no error yet.
 */
static size_t list_unknowns(const model_t *model, refine_unknown_t *unknown, bool *open) {
    size_t count = 0;
    *open = false;
    for (size_t b = 0; b < model->blocks; b++) {
        const block_t *block = model->block[b].block;
        for (size_t p = 0; p < block->parameters; p++) {
            const parameter_t *parameter = &model->block[b].parameter[p];
            for (size_t e = 0; found(&block->parameter[p], parameter) && e < parameter->count; e++) {
                const bool unused = block->parameter[p].array && parameter->value[e] == 0.0;
                if (parameter->sigma != NULL ? parameter->sigma[e] == 0.0 : unused) {
                    continue;
                }
                if (unknown != NULL) {
                    unknown[count] = refine_unknown_at(model, b, p, e);
                }
                count++;
                *open = *open || parameter->sigma == NULL;
            }
        }
    }
    return count;
}

size_t fit_count_found(const model_t *model) {
    bool open;
    return list_unknowns(model, NULL, &open);
}

/* "cutoff_hz of amplifier_bandwidth", "weights[3] of prandtl_ishlinskii". */
static void name_of(const model_t *model, const refine_unknown_t *unknown, char *text, size_t size) {
    const block_t *block = model->block[unknown->block].block;
    const parameter_info_t *info = &block->parameter[unknown->parameter];
    char element[24] = "";
    if (info->array) {
        snprintf(element, sizeof element, "[%zu]", unknown->element);
    }
    snprintf(text, size, "%s%s of %s", info->name, element, block->name);
}

/* One line a parameter. */
static void note_undetermined(const model_t *model, const refine_unknown_t *unknown, const refine_report_t *report,
                              family_notes_t *notes) {
    for (size_t b = 0; b < model->blocks; b++) {
        const block_t *block = model->block[b].block;
        for (size_t p = 0; p < block->parameters; p++) {
            size_t lost = 0;
            for (size_t u = 0; u < report->unknowns; u++) {
                lost += unknown[u].block == b && unknown[u].parameter == p && report->state[u] == REFINE_NOT_DETERMINED;
            }
            if (lost > 0 && block->parameter[p].array) {
                family_note(notes, "not determined by these recordings: %zu of %zu %s of %s", lost,
                            model->block[b].parameter[p].count, block->parameter[p].name, block->name);
            } else if (lost > 0) {
                family_note(notes, "not determined by these recordings: %s of %s", block->parameter[p].name,
                            block->name);
            }
        }
    }
}

/* Pairs of parameters with strongly correlated errors. */
static void note_correlated(const model_t *model, const refine_unknown_t *unknown, const refine_report_t *report,
                            family_notes_t *notes) {
    enum { MOST_PAIRS = 5 };
    const size_t n = report->unknowns;
    size_t pairs = 0;
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i && pairs < MOST_PAIRS; j++) {
            const double correlation = report->correlation[i * n + j];
            if (fabs(correlation) > close_correlation && report->state[i] == REFINE_DETERMINED &&
                report->state[j] == REFINE_DETERMINED) {
                char name[100], other[100];
                name_of(model, &unknown[i], name, sizeof name);
                name_of(model, &unknown[j], other, sizeof other);
                family_note(notes, "strongly correlated estimates: %s and %s (correlation %.3f)", other, name,
                            correlation);
                pairs++;
            }
        }
    }
}

bool fit_find_errors(model_t *model, const recording_t *recordings, size_t count, const size_t *train_to,
                     progress_t *progress, family_notes_t *notes, failure_t *failure) {
    const size_t all = fit_count_found(model);
    refine_unknown_t *unknown;
    refine_report_t report;
    bool open, good;
    if (json_object_get(model->fit, "smoothing") != NULL) { /* parameters that the smoothing couples */
        return true;
    }
    if (all > FIT_MAX_ERRORS) {
        family_note(notes, "no standard errors: the model has %zu numbers", all);
        return true;
    }
    unknown = allocate(all, sizeof *unknown);
    refine_job_t job = {.recordings = recordings, .count = count, .to = train_to, .unknown = unknown};
    job.unknowns = list_unknowns(model, unknown, &open);
    job.progress = progress;
    good = !open || refine(model, &job, &report, failure);
    if (open && good) {
        refine_keep_errors(model, &job, &report);
        family_note(notes, "joint standard errors allow for a residual that is correlated over %.0f samples",
                    report.autocorrelation_samples);
        note_undetermined(model, unknown, &report, notes);
        note_correlated(model, unknown, &report, notes);
        refine_report_free(&report);
    }
    free(unknown);
    return good;
}
