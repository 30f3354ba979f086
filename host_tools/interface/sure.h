/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * How sure an answer is: recordings are simulated from it and from what it can be confused with, with the user's own
 * drive, sampling and noise, and asked again by the same engine.
 *
 * Where something was found there is one world with the answer. For each finding there is one with every block that
 * it can be confused with in its place, or, where there is none, with the one that came next in the search. That block
 * is fitted to the user's recordings there. Where nothing was found: one world as it is, and for a few blocks one with
 * a third of the block's detection limit, and one with three times that.
 *
 * The same seed and number give the same counts, whatever the machine.
 */
#ifndef SURE_H
#define SURE_H

#include "interface/diagnosis_run.h"

enum { SURE_MOST_WORLDS = 8 };

/** Seconds that the default number of recordings is chosen for; at least SURE_LEAST and at most SURE_MOST of each kind:
 * fewer say nothing, and of 20 one is 5 percent. */
enum { SURE_DEFAULT_S = 300, SURE_LEAST = 4, SURE_MOST = 20 };

typedef struct {
    model_t model;
    size_t from, to; /**< its questions in sure.question */
} sure_world_t;

/** The work to do. */
typedef struct {
    sure_t sure;
    size_t worlds;
    sure_world_t world[SURE_MOST_WORLDS];
    double seconds; /**< it will take about so long */
} sure_work_t;

/** each: recordings of each kind, 0: as many as end in SURE_DEFAULT_S. took_s: what the diagnosis itself took. The work
 * is freed by sure_ask or sure_forget. */
void sure_prepare(const diagnosis_run_t *run, size_t each, unsigned long seed, double took_s, sure_work_t *work);

/** Frees work that is not asked. */
void sure_forget(sure_work_t *work);

/** Does the work, frees it, and puts the counts into run->sure. given, recordings: those of the run. */
bool sure_ask(sure_work_t *work, const model_t *given, const recording_t *recordings, size_t count,
              diagnosis_run_t *run, failure_t *failure);

#endif
