/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What tests of the look share that make their recordings in place: one recording, its look and what that says. setUp
 * and tearDown of Unity are here. */
#ifndef ONE_LOOK_H
#define ONE_LOOK_H

#include "look/look.h"
#include "random.h"
#include <complex.h>

enum { SAMPLES = 16384 };
extern const double rate_hz;
extern const double errors; /**< standard errors that are allowed: exceeded once in 16000 */
/** Started by main. */
extern random_t rng;
/** New for each test: SAMPLES at rate_hz. */
extern recording_t recording;
extern look_t look;
extern failure_t failure;

/** Columns of the recording. */
double *drive(void);
double *position(void);

/** Looks at the recording; to be freed by the test. */
void see(void);
/** What the look says of it, without faults. */
const char *said(void);

/** A drive with a level at random every so many samples. */
void fill_levels(size_t hold);

/** A mode of the position behind the drive: its frequency, its response at any, and what it makes of the drive. */
extern const double mode_hz;
double complex mode_at(double f);
void fill_with_mode(double noise_um);

#endif
