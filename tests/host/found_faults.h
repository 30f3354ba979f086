/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What tests of the faults share: recordings of a scene (looked_at.h), and what is found in them. */
#ifndef FOUND_FAULTS_H
#define FOUND_FAULTS_H

#include "looked_at.h"

enum { DRIVES = INSTRUMENTED ? 1 : SCENE_DRIVES }; /* the code that looks is the same for all */
extern random_t rng;
extern scene_t scene;
extern recording_t recordings[2];
extern look_t *looks;
extern fault_list_t faults;
extern double late[SCENE_SAMPLES]; /**< of each reading of the next recording, in samples */

/** Readings are so much later from an instant on. */
void shift_from(size_t at, double samples);

/** The first recording, of the scene's drive `which`. Returns its readings. */
double *record(size_t which);
/** Looks at so many recordings, and for their faults. */
void look_at_them(size_t count);
/** Frees them, their looks, the faults and the scene. */
void close_all(size_t count);

/** All that was found, for a message. */
const char *found(size_t which);
/** The only fault that there is. */
const fault_t *only(size_t which, const fault_kind_t *kind);
/** The same where a fault may also stay unseen, because the reference does not follow this hysteresis closely enough:
 * nothing else is said then. NULL: it stayed unseen. */
const fault_t *only_or_none(size_t which, const fault_kind_t *kind);
/** A number of a fault, which it must have. */
const fault_number_t *number(const fault_t *fault, const char *name);
/** It is right within four of its standard errors (once in 16000). */
void expect_number(const fault_t *fault, const char *name, double value);
/** It is where it was put, or a sample beside: the span is three deviations of the noise wide, and its ends are whole
 * samples. */
void expect_near(const fault_t *fault, size_t sample);

#endif
