/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Every threshold of this room: value, unit, why, and what becomes worse on either side.
 *
 *     name                        unit              lower                            higher
 */
#ifndef BELIEF_THRESHOLDS_H
#define BELIEF_THRESHOLDS_H

/** Natural units of evidence that a block has to be worth beside the universal operator. Of the recordings with nothing
 * missing that it was chosen on the loudest block had 33. Lower: blocks are looked for where nothing is missing.
 * Higher: effects below three times the noise are passed over. */
static const double least_gain = 60.0;
/** By how much less evidence, in natural units, another block may have to stand in a finding's place: this, or these
 * fractions of the finding's evidence. Among lags more, because they are as small as the drive's motion between
 * samples. From a trial with another implementation; not calibrated with this one. Lower: the set of names misses the
 * right one. Higher: it says nothing. */
static const double least_margin = 10.0, part_margin = 0.03, lag_margin = 0.08;
/** Part of the largest gain of a scan that a block has to have to be refined. A guess that saves time, not calibrated.
 * Lower: time. Higher: a block whose probes are far from its numbers is not among the rivals. */
static const double least_promise = 0.25;
/** Variance of a held-out sample's prediction, in parts of the noise's, above which it is not determined by the fitted
 * ones and says nothing. Lower: fewer samples are scored. Higher: amplitudes that occur once count as misfit. */
static const double most_open = 0.3;
/** Root mean square of what is left of held-out samples over what it should be. 60 recordings with nothing missing had
 * 0.97 to 1.11. Lower: shapes that the operator only comes near are unknown physics. Higher: effects of half the noise
 * count as shape. */
static const double most_deviations = 1.15;
/** Part of the held-out samples that may be not determined. Lower: recordings without repetition are never judged.
 * Higher: what was judged is not the recording. */
static const double most_not_determined = 0.5;
/** Part of the samples that may be pulled in as outliers. Lower: a sensor that now and then misreads is unknown
 * physics. Higher: jumps and rings are taken for outliers. */
static const double most_outliers = 0.02;
/** Mean square of what is left where the drive moves over that where it rests (and the converter's steps). Lower: small
 * errors of the operator are unknown physics. Higher: what acts only in motion, jitter say, is taken for noise. */
static const double most_moving_over_resting = 1.5;
/** The drive rests when it has stayed within this part of its range for so long. Both as in noise.c. */
static const double still = 1e-3, least_rest_s = 0.05, least_rest_samples = 20.0;
/** Samples at rest, and in motion, for that comparison: their mean square is then known to a tenth. */
enum { least_resting = 200 };

#endif
