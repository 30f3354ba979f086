/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The drive before a recording: its header key, and what of it and of the beginning counts where that is left out. */
#include "recording/recording.h"
#include "recording/table/decimal.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool recording_drive_before(const recording_t *recording, double before_v[RECORDING_MOST_BEFORE], size_t *points,
                            failure_t *failure) {
    const char *at = recording_key(recording, RECORDING_BEFORE_KEY);
    *points = 0;
    for (bool more = at != NULL; more;) {
        const char *end = at + strspn(at, " \t");
        double number;
        if (!decimal_read(end, '.', &number, &end) || !(fabs(number) <= RECORDING_LARGEST)) {
            return fail(failure,
                        "%s: header key drive_before_v has '%s', not the turning points of the drive in V with commas "
                        "between them",
                        recording->name, at);
        }
        if (*points == RECORDING_MOST_BEFORE) {
            return fail(failure, "%s: header key drive_before_v has more than %d turning points: give the last ones",
                        recording->name, RECORDING_MOST_BEFORE);
        }
        before_v[(*points)++] = number;
        end += strspn(end, " \t");
        more = *end != '\0';
        if (more && *end != ',') {
            return fail(failure, "%s: header key drive_before_v: '%s' where a comma should be", recording->name, end);
        }
        at = more ? end + 1 : end;
    }
    return true;
}

/* The turning points that a hysteresis remembers, each inside of the two before it, and the last drive. */
typedef struct {
    double *point;
    size_t count;
} turns_t;

/* A drive that goes on as before moves the last point; one that leaves the loop between the last two erases both. */
static void go_to(turns_t *turns, double drive) {
    double *p = turns->point;
    size_t n = turns->count;
    while (n > 1 && ((drive - p[n - 1]) * (p[n - 1] - p[n - 2]) >= 0.0 ||
                     (n > 2 && fabs(drive - p[n - 1]) >= fabs(p[n - 1] - p[n - 2])))) {
        n -= (drive - p[n - 1]) * (p[n - 1] - p[n - 2]) >= 0.0 ? 1 : 2;
    }
    p[n] = drive;
    turns->count = n + 1;
}

void recording_move_before(recording_t *recording, const double *drive, size_t samples) {
    double before_v[RECORDING_MOST_BEFORE];
    size_t points;
    failure_t refusal;
    if (!recording_drive_before(recording, before_v, &points, &refusal) || points == 0 || samples == 0) {
        return; /* who reads the key tells what is wrong with it */
    }
    turns_t turns = {.point = allocate(points + samples, sizeof(double))};
    for (size_t i = 0; i < points; i++) {
        go_to(&turns, before_v[i]);
    }
    for (size_t k = 0; k < samples; k++) {
        go_to(&turns, drive[k]);
    }
    char text[RECORDING_MOST_BEFORE * 24] = "";
    for (size_t i = 0, length = 0; i < turns.count && i < RECORDING_MOST_BEFORE; i++) {
        length += (size_t)snprintf(text + length, sizeof text - length, "%s%.12g", i > 0 ? ", " : "", turns.point[i]);
    }
    recording_set_key(recording, RECORDING_BEFORE_KEY, text);
    free(turns.point);
}
