/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Recordings whose drive and displacement are exchanged: what is fitted or diagnosed of them is about nothing. */
#ifndef EXCHANGED_H
#define EXCHANGED_H

#include "recording/recording.h"

/**
 * Fails if one of the recordings has them exchanged, with a line that says so and ends with what to do: `hint`, or, if
 * it is NULL, the commands' own. That is so if it looks so (look/swapped.h), and play operators that are fitted the
 * other way round leave less: less than as it is, and less than with the drive moved to a position that is early. Play
 * operators cannot lead: of a recording that is right they leave less as it is, or moved. A fit is made only where it
 * looks so. Of a long recording the part counts that a diagnosis would use (diagnosis/question/excerpt.h). Exchanged
 * columns of some actuators pass (docs/DIAGNOSIS.md has how many).
 */
bool exchanged_refuse(const recording_t *recordings, size_t count, const char *hint, failure_t *failure);

#endif
