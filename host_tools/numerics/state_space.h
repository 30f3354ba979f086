/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A linear filter of few states, for one column or for many at once:
 *
 *     y[k - ahead] = c s[k] + d x[k],   s[k + 1] = A s[k] + b x[k]
 *
 * Before its first sample the input is taken to have been constant, and behind its last one to stay so.
 */
#ifndef STATE_SPACE_H
#define STATE_SPACE_H

#include <stdbool.h>
#include <stddef.h>

enum {
    STATE_SPACE_MOST = 28, /**< states */
    STATE_SPACE_ROWS = 32, /**< that are filtered at once, at most */
    STATE_SPACE_AHEAD = 2
};

typedef struct {
    size_t states, ahead; /**< ahead: at most STATE_SPACE_AHEAD */
    double a[STATE_SPACE_MOST][STATE_SPACE_MOST], b[STATE_SPACE_MOST], c[STATE_SPACE_MOST], d;
} state_space_t;

/** Leaves everything as it is. */
state_space_t state_space_identity(void);
bool state_space_is_identity(const state_space_t *filter);

/** One behind the other. false: together they have more than STATE_SPACE_MOST states, or look too far ahead. */
bool state_space_cascade(const state_space_t *first, const state_space_t *second, state_space_t *both);

/** y / x at rest. */
double state_space_gain_at_rest(const state_space_t *filter);

/** One column, in place. */
void state_space_column(const state_space_t *filter, double *value, size_t samples);

/**
 * The filter with this impulse response, of the fewest states that come within `tolerance` of its step response, or of
 * those up to `most` that come nearest (Ho and Kalman 1966; Kung 1978). response[ahead] is that at the impulse. Returns
 * the largest error of the step response, in parts of its largest value; HUGE_VAL: there is none, or nothing that is
 * stable.
 */
double state_space_realise(const double *response, size_t length, size_t ahead, size_t most, double tolerance,
                           state_space_t *filter);

/** A filter that is ready for rows of a number of columns. To be closed. */
typedef struct {
    size_t states, columns;
    double response[STATE_SPACE_ROWS];                   /**< to an impulse */
    double by_state[STATE_SPACE_ROWS][STATE_SPACE_MOST]; /**< c A^k */
    double fed[STATE_SPACE_MOST][STATE_SPACE_ROWS];      /**< A^(rows - 1 - k) b */
    double power[STATE_SPACE_MOST][STATE_SPACE_MOST];    /**< A^rows */
    double steady[STATE_SPACE_MOST];                     /**< the states at a constant input of 1 */
    double *memory, *next;                               /**< states * columns; NULL without states */
} state_space_rows_t;

void state_space_rows_open(state_space_rows_t *rows, const state_space_t *filter, size_t columns);
void state_space_rows_close(state_space_rows_t *rows);

/**
 * Rows that follow each other, STATE_SPACE_ROWS or, at the end of a recording, fewer; gives some of them:
 * filtered[i * columns] is the filter's output at row taken[i] (rising). first: the rows begin a recording.
 */
void state_space_rows(state_space_rows_t *rows, const double *row, size_t count, bool first, const size_t *taken,
                      size_t some, double *filtered);

#endif
