/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What no physical effect explains is described all the same, so that the model gets better although the cause is
 * unknown: by empirical blocks (block_t.empirical), a curve of the position, of time, a linear filter, a tone.
 */
#ifndef EMPIRICAL_H
#define EMPIRICAL_H

#include "diagnosis/answer/state.h"

/** Terms that a diagnosis may have. */
enum { EMPIRICAL_MOST = 2 };

/**
 * The last stage. Where the verdict is unknown physics or partly explained, structure remains, and no measured column
 * goes with it (measured_columns.h), each empirical block is fitted at its place in the chain, together with the
 * hysteresis and with what was found. The one that leaves the least error of the held-out samples is taken, then
 * perhaps a second one, if it
 *
 * - takes much_of_it of the square of that error beyond the noise (of all of it, where the noise is not
 *   known), and this is more than worth_explaining of the noise's;
 * - is worth least_support to them;
 * - and the error of whole recordings, as `hyst simulate` tells it, does not grow.
 *
 * A term stands behind the findings, detected and no more. The verdict stays, and so does what cannot be seen: a term
 * is no cause. The remainder becomes that of the better model, structured as it was.
 */
bool empirical_describe(state_t *state);

#endif
