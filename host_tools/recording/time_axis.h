/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Sample times of the rows of a table. */
#ifndef TIME_AXIS_H
#define TIME_AXIS_H

#include "recording/recording.h"
#include "recording/table/table.h"

typedef struct {
    double sample_rate_hz, start_s;
    double *stamp_s; /**< of each row, if they are uneven and the rows must be resampled; else NULL */
    bool unit_taken; /**< nothing says in which unit the stamps are: they are taken for s */
    char text[240];  /**< what was found: "0 to 39.995 s, 200 Hz" */
} time_axis_t;

/**
 * column: that of the time stamps, or -1; counts: its name says that it numbers the samples. The rate follows from the
 * stamps, rounded to the fewest digits that their resolution allows. A rate from the options or the file must agree
 * within 0.5 %; it is used if there are no stamps, or only sample numbers. Stamps uneven by more than a quarter of a
 * sample: stamp_s is set. False for a gap: of more than a sample and a half beside even neighbours, of more than four
 * beside uneven ones. So for a rate that changes: where the mean of 64 steps is more than half as long again in one
 * part as in another. So for stamps that repeat or go back, for numbers that leave one out, and without any rate.
 *
 * Stamps without a unit are in seconds; in thousandths, millionths or billionths, where a rate says so or where they
 * are then a time since 1970. So are Windows' steps of 100 ns, and the days of spreadsheets and MATLAB. A clock that
 * begins anew at midnight, or a counter at 2^32, goes on.
 */
bool time_axis_find(time_axis_t *axis, const table_t *table, int column, bool counts, double given_rate_hz,
                    failure_t *failure);

/** How much later the times of one column are than those of another, in s; false: not by the same for all rows, within
 * a quarter of a sample. */
bool time_axis_later(const table_t *table, int first, int second, double step_s, double *later_s);

/** Whether a second column rises all the time, but at another rate: times of other samples. */
bool time_axis_is_other(const table_t *table, int first, int second);

/** Resamples all columns at even instants, if needed. */
void time_axis_resample(const time_axis_t *axis, recording_t *recording);

void time_axis_free(time_axis_t *axis);

#endif
