/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Faults of recordings, which look like physics and are none.
 *
 * A kind of fault is one file in look/faults, which the build finds (cmake/ListParts.cmake). It reads the looks and
 * appends what it finds, each with the chance that a recording without this fault shows a statistic as extreme, counted
 * over all places where it was looked for. The chance follows from the statistic's distribution, not from recordings; a
 * fault is reported if it is below threshold.false_fault. Beside that each kind states in its file what else has to
 * hold, for physics that could show the same.
 */
#ifndef LOOK_FAULT_H
#define LOOK_FAULT_H

#include "fault_kind_list.h"
#include "look/look.h"

enum { FAULT_MOST_NUMBERS = 5, FAULT_MOST_CHOICES = 3 };

typedef enum {
    FAULT_MASKABLE,   /**< leaving its samples out is enough */
    FAULT_MODELLABLE, /**< numbers that can be fitted with the model */
    FAULT_FATAL       /**< record again, or repair the file */
} fault_handling_t;

typedef struct {
    const char *name, *unit;
    double value, sigma; /**< sigma: standard error; HUGE_VAL: not known, 0: exact */
} fault_number_t;

typedef struct fault_kind fault_kind_t;

typedef struct {
    const fault_kind_t *kind;
    size_t recording;  /**< index of the look */
    double log_chance; /**< log10 */
    double evidence;   /**< the statistic, as fault_kind_t.statistic says */
    size_t numbers;
    fault_number_t number[FAULT_MOST_NUMBERS];
    size_t spans;      /**< 0: all of the recording */
    look_span_t *span; /**< samples, in order of time */
    bool undone;       /**< in the readings, by fault_undo */
    bool suspected;    /**< by fault_kind_t.suspect, and not found by the statistic */
} fault_t;

typedef struct {
    size_t count;
    fault_t *fault;
    size_t withdrawn; /**< faults that were on it, and are none (fault_withdraw) */
} fault_list_t;

struct fault_kind {
    const char *name;      /**< "dropped_samples": `block` of the finding */
    unsigned order;        /**< in the report; 10, 20 .., so that another fits between. Unique */
    const char *text;      /**< what it is, a sentence for someone in a lab */
    const char *statistic; /**< what `evidence` is, and why the chance follows from it */
    const char *change;    /**< what to change in the set-up */
    fault_handling_t handling;
    bool alone; /**< with it, what the others say of the same recording is about something else: it is left out */
    void (*find)(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults);
    /** Sets the readings of this look's recording right, as well as its numbers say; what is lost stays masked. Returns
     * the sum of log(gain) over all readings that were divided by one. NULL: it cannot be undone. */
    double (*undo)(const fault_t *fault, const look_t *look, recording_t *recording);
    /** Of a fault of one size that can be undone: whether a recording may have it that the statistic cannot tell, and
     * about how large; and a fault of another size. NULL: none. Whether there is one, and of which size, says how
     * likely the readings are with it undone (interface/diagnosis_run.h); `hyst look` does not report it. */
    bool (*suspect)(const look_t *look, double *size);
    void (*resize)(fault_t *fault, const look_t *look, double size);
    /** Of a fault with a part that no statistic tells: sizes of that part for `resize`, returns how many. The one that
     * makes the readings likeliest, with the fault undone, is taken. NULL: none. */
    size_t (*choices)(const fault_t *fault, double size[FAULT_MOST_CHOICES]);
};

#define FAULT_DECLARE(name) extern const fault_kind_t fault_##name;
FAULT_KIND_LIST(FAULT_DECLARE)
#undef FAULT_DECLARE

/** Every kind there is, in the order in which they are reported. */
extern const fault_kind_t *const fault_kinds[];
extern const size_t fault_kind_count;

/** All faults of these looks, in the order of the kinds; to be freed. */
void faults_find(const look_t *looks, size_t count, fault_list_t *faults);
void faults_free(fault_list_t *faults);

/** For the kinds: appends one if its chance is below the limit, with no numbers and no samples yet. NULL: it is not. */
fault_t *fault_add(fault_list_t *faults, const fault_kind_t *kind, size_t recording, double evidence,
                   double log_chance);
void fault_number(fault_t *fault, const char *name, const char *unit, double value, double sigma);
void fault_span(fault_t *fault, size_t from, size_t to);
/** Whether a fault of that kind was found in the recording. */
bool fault_found(const fault_list_t *faults, const fault_kind_t *kind, size_t recording);
/** Leaves the samples of all maskable faults out of the recordings (recording_mask). Returns how many. What was found
 * is a fact about the readings as they were; looks at them are not to be used afterwards. */
size_t faults_mask(const fault_list_t *faults, recording_t *recordings);
/** Takes a fault off the list, because what it says is explained better without it. */
void fault_withdraw(fault_list_t *faults, size_t index);
/** "maskable", "modellable", "fatal" */
const char *fault_handling_name(fault_handling_t handling);
/** Samples of all spans; the whole recording without any. */
size_t fault_samples(const fault_t *fault, const look_t *looks);

#endif
