/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The names of the findings once more, when all are known: each was chosen while those after it were still missing, and
 * these may have been what told it from the others of its group (probe.h).
 */
#ifndef NAMES_H
#define NAMES_H

#include "diagnosis/answer/state.h"

/**
 * Puts each other block of a finding's group in its place, looks for its best numbers, and fits everything together.
 * The finding becomes the block under which all samples, held-out ones included, are likeliest, searched numbers paid
 * for; those that are less likely by less than naming_margin are what it can be confused with. Where more
 * than noise is left, a name changes only if the held-out samples by themselves agree, and is as sure as it was. Only
 * there a richer form of the finding's group is tried, too (probe_t.in_place_of); what was found beside one that took
 * its place may be superfluous then, and is taken out.
 *
 * A small drift beside a creep may be the rest of that: it is reported as one of the two. So is a relaxation that
 * begins as fast as can be seen, or so late that the recordings show hardly any of it (probe_t.times).
 */
bool names_settle(state_t *state);

#endif
