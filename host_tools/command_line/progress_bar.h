/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Progress bar on stderr. Draws only when stderr is a terminal, at most ten times a second. */
#ifndef PROGRESS_BAR_H
#define PROGRESS_BAR_H

#include "base/progress.h"

/** For progress_listen. */
extern const progress_listener_t progress_bar;

#endif
