/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A diagnosis whose search is given, as the tests of its outputs tell it: two recordings of a bank of plays and a mode
 * at 180 Hz, damping 0.05, with white noise, and the chain with the true block and its true numbers, as the search
 * would leave it. setUp and tearDown of Unity are here.
 */
#ifndef TOLD_DIAGNOSIS_H
#define TOLD_DIAGNOSIS_H

#include "chain/catalogue.h"
#include "report/diagnosis_json.h"
#include "report/diagnosis_print.h"
#include "report/diagnosis_report.h"
#include "support.h"

enum { SAMPLES = 6000, RECORDINGS = 2 };
#define RATE_HZ  2000.0
#define NOISE_UM 0.003

/** Started by main. */
extern random_t rng;
extern recording_t recordings[RECORDINGS];
extern question_t *question;
extern answer_t diagnosis;
/** Empty until work_out, to be freed by the test. */
extern account_t account;
extern failure_t failure;

/** What the command does when the search is over. */
void work_out(void);

/** A new reference. */
json_t *as_json(void);

/** Every key with its type, and no other: a format of json_unpack. */
void expect_format(json_t *json, const char *format, ...);

#endif
