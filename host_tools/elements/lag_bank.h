/* SPDX-License-Identifier: GPL-3.0-or-later */
/** First-order lags of one input, followed together: first_order_lag_next of each, to the last bit. They do not wait
 * for each other, so a compiler takes two at once. */
#ifndef LAG_BANK_H
#define LAG_BANK_H

#include "elements/first_order_lag.h"

enum { LAG_BANK_PLACES = 14 };

/** The numbers of first_order_lag_t, each of all lags. All 0: places without a lag, whose output is 0. */
typedef struct {
    size_t lags;
    bool held;
    double output[LAG_BANK_PLACES], decay[LAG_BANK_PLACES];
    double cubic[4][LAG_BANK_PLACES], line[2][LAG_BANK_PLACES], hold[2][LAG_BANK_PLACES];
} lag_bank_t;

/** One more, at most LAG_BANK_PLACES. All are held, or none is. */
void lag_bank_add(lag_bank_t *bank, const first_order_lag_t *lag);
/** All outputs in the steady state. */
void lag_bank_settle(lag_bank_t *bank, double value);
/** One sample: returns the sum of the outputs. */
double lag_bank_next(lag_bank_t *bank, const drive_window_t *drive);

#endif
