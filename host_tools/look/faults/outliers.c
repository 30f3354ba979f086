/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Single wrong readings: look/path/wrong.h. */
#include "look/fault.h"
#include "thresholds/thresholds.h"
#include <gsl/gsl_sort.h>
#include <stdlib.h>

/* The reading that most of them share, if half of them do. */
static bool shared_reading(const double *y, const wrong_t *wrong, double *value) {
    double *read = allocate(wrong->count, sizeof *read);
    size_t same = 0;
    for (size_t i = 0; i < wrong->count; i++) {
        read[i] = y[wrong->at[i]];
    }
    gsl_sort(read, 1, wrong->count);
    *value = read[wrong->count / 2];
    for (size_t i = 0; i < wrong->count; i++) {
        same += read[i] == *value ? 1 : 0;
    }
    free(read);
    return (double)wrong->count >= threshold.least_to_share && 2 * same > wrong->count;
}

/* Width of the ranges without readings that were found. */
static double gap_um(const fault_list_t *faults, size_t recording) {
    for (size_t i = 0; i < faults->count; i++) {
        const fault_t *fault = &faults->fault[i];
        if (fault->kind == &fault_missing_codes && fault->recording == recording) {
            return fault->number[1].value;
        }
    }
    return 0.0;
}

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        const wrong_t *wrong = &looks[i].wrong;
        if (fault_found(faults, &fault_missing_codes, i) &&
            wrong->largest_um < threshold.beyond_gap * gap_um(faults, i)) {
            continue; /* readings that jump over a gap */
        }
        fault_t *fault = fault_add(faults, kind, i, wrong->scales, wrong->log_chance);
        if (fault != NULL) {
            double shared;
            fault_number(fault, "samples", "1", (double)wrong->count, 0.0);
            fault_number(fault, "largest_um", "um", wrong->largest_um, looks[i].prediction.noise_um);
            if (shared_reading(looks[i].recording->column[COLUMN_DISPLACEMENT], wrong, &shared)) {
                fault_number(fault, "reading_um", "um", shared, 0.0);
            }
            for (size_t w = 0; w < wrong->count; w++) {
                fault_span(fault, wrong->at[w], wrong->at[w] + 1);
            }
        }
    }
}

const fault_kind_t fault_outliers = {
    .name = "outliers",
    .order = 60,
    .text = "Single readings are far from their neighbours, and not by a motion of the drive.",
    .statistic = "largest error of the prediction from neighbours, in scales of its exponential tail",
    .change = "Look at the sensor's cable, its bus and its error flags; a driver that returns 0 after a failed read "
              "shows as equal readings. Leave these samples out.",
    .handling = FAULT_MASKABLE,
    .find = find};
