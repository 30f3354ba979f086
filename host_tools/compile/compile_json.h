/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What `hyst compile --json` prints. */
#ifndef COMPILE_JSON_H
#define COMPILE_JSON_H

#include "compile/compile_report.h"
#include "hyst/parameters.h"

/** A new reference. */
json_t *compile_to_json(const hyst_parameters_t *parameters, const compile_report_t *report);

#endif
