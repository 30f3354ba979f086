/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The evidence's working space, for tests that bring columns of their own. */
#ifndef EVIDENCE_COLUMNS_H
#define EVIDENCE_COLUMNS_H

#include "evidence.h"

/** Whitens columns, one a recording with all its samples (recordings_room), scales them to a root mean square of 1 if
 * `scaled`, and takes J out of them. `rows` has as many elements as the residual. */
void evidence_beyond(const evidence_t *evidence, double **columns, bool scaled, double *rows);

/** The whitened residual beyond J; 0 where a sample is held out. */
const double *evidence_residual(const evidence_t *evidence, size_t *rows);

#endif
