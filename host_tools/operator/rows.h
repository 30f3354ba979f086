/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Rows of the operator's columns along paths, behind a filter and whitened. */
#ifndef OPERATOR_ROWS_H
#define OPERATOR_ROWS_H

#include "operator/path.h"
#include "operator/pink.h"

/** Which rows: of the samples that are used (or not), of all paths one after the other, every `thin`-th. */
typedef struct {
    const operator_t *operator;
    const operator_path_t *paths;
    size_t count;
    bool turns;                  /**< of hike_begin */
    const state_space_t *behind; /**< what the columns pass through before they are whitened */
    bool offsets_behind;         /**< but for the offsets, which are added behind it */
    const pink_t *noise;
    const unsigned char *use;
    bool unused; /**< of the samples with use[k] == 0, not of the others */
    size_t thin;
} rows_wanted_t;

/** Rows that stand one after the other, at most STATE_SPACE_ROWS; may be changed. sample: of each, of all paths. */
typedef void rows_taker_t(void *context, double *row, const size_t *sample, size_t rows);

/** Hands all that are wanted on, in order and some at a time. */
void rows_stream(const rows_wanted_t *wanted, rows_taker_t *take, void *context);

/** Rows that are kept. */
typedef struct {
    size_t rows, columns;
    double *row;    /**< rows * columns */
    size_t *sample; /**< of each row */
} kept_rows_t;

/** To be freed. */
void kept_rows_open(kept_rows_t *kept, const rows_wanted_t *wanted);
/** The same whitened for several noises in one walk along the paths, in place of wanted->noise. kept[i]: for noise[i].
 * No more than ROWS_MOST_NOISES. */
enum { ROWS_MOST_NOISES = 3 };
void kept_rows_open_each(kept_rows_t *const *kept, const rows_wanted_t *wanted, const pink_t *const *noise,
                         size_t noises);
void kept_rows_close(kept_rows_t *kept);

/** Of a column over all samples as it stands: whitened, in these rows. value[row * stride]. */
void kept_rows_whiten(const kept_rows_t *kept, const operator_path_t *paths, size_t count, const pink_t *noise,
                      const double *column, double *value, size_t stride);

#endif
