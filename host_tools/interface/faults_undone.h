/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Which faults of recordings are set right before physics is looked for: those that make the readings likelier then,
 * beside a hysteresis of any shape.
 */
#ifndef FAULTS_UNDONE_H
#define FAULTS_UNDONE_H

#include "base/progress.h"
#include "look/fault.h"

/** Readings that are not masked. */
size_t readings_that_count(const recording_t *recording);

/** Sets the readings right as far as they get likelier so, and withdraws the faults by which they do not. Adds those
 * that only the readings' likelihood speaks for (fault_t.suspected), which are not undone yet. */
void faults_undo(recording_t *recordings, const look_t *looks, size_t count, fault_list_t *faults,
                 progress_t *progress);

/** Of the suspected ones: whether there are some; undone in the readings, too; or off the list. */
bool faults_some_suspected(const fault_list_t *faults);
void faults_undo_suspected(recording_t *recordings, const look_t *looks, fault_list_t *faults);
void faults_withdraw_suspected(fault_list_t *faults);

#endif
