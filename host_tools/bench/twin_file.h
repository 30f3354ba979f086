/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The twin of a model file. */
#ifndef TWIN_FILE_H
#define TWIN_FILE_H

#include "bench/twin.h"

/** Reads the model and opens the twin; ranges that were not given come from the model. NULL on failure. */
twin_t *twin_from_file(const char *model_path, const twin_options_t *given, failure_t *failure);

#endif
