/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What `hyst watch` leaves of a warning: a page and a JSON file that say what changed, since when, how sure that is and
 * what to push. The words are those of the diagnosis; nothing here knows what to expect.
 */
#ifndef EVENT_PAGE_H
#define EVENT_PAGE_H

#include "diagnosis/account/account.h"
#include <time.h>

typedef struct {
    time_t warned_at;          /**< of the host's clock */
    double sample_time_s;      /**< of the warning, of the amplifier's samples since it started */
    double warned_s;           /**< the warning, from the beginning of the record on */
    double since_s;            /**< when the error grew, likewise; NAN: before the record begins */
    double limit_um, usual_um; /**< root mean square of the error: the limit, and what was there before */
    double rms_um;             /**< of the record, from since_s on */
    double usual_supply_v,
        supply_v;              /**< of the stage: when the limit was set, and at the record's end; NAN: not measured */
    const recording_t *record; /**< the whole: reference, drive, displacement */
    const char *folder;        /**< where recording.csv, diagnosis.html and better.json are, beside the page */
    bool better;               /**< better.json can be compiled */
    const char *not_better;    /**< why not, or what it leaves out; NULL: nothing to say */
} event_t;

/** "2026-11-23T08:12:33Z", text[EVENT_TIME]. */
enum { EVENT_TIME = 32, EVENT_SUPPLY = 120 };
/** How late it may be that an error grew, after event_since_s. */
#define EVENT_SINCE_S 0.1
void event_time_text(time_t time, char text[EVENT_TIME]);

/** When the error, position less reference, grew: the end of the last stretch of a tenth of a second whose root mean
 * square was still nearer to the usual one than to the limit. By `judged_s` before the warning it had grown, as the
 * amplifier warns after so long. NAN: there is no such stretch. */
double event_since_s(const recording_t *record, double warned_s, double judged_s, double usual_um, double limit_um);

/** "The high-voltage supply fell from 150.0 V to 118.2 V." Empty where it is not measured. */
void event_supply_text(const event_t *event, char text[EVENT_SUPPLY]);

bool event_write_page(const event_t *event, const answer_t *answer, const account_t *account, const char *path,
                      failure_t *failure);

/** Format hyst-watch-1 (docs/FORMATS.md). recordings, count: those of the diagnosis. */
bool event_write_json(const event_t *event, const answer_t *answer, const account_t *account,
                      const recording_t *recordings, size_t count, const char *path, failure_t *failure);

#endif
