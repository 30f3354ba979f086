/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The look for programs: docs/FORMATS.md, "Look". */
#ifndef LOOK_JSON_H
#define LOOK_JSON_H

#include "base/json_output.h"
#include "look/fault.h"

/** {"recordings": [...], "faults": [...]}: a new reference. */
json_t *looks_to_json(const look_t *looks, size_t count, const fault_list_t *faults);

/** One fault as a finding: block, place "recording", parameters, where, explanation .. */
json_t *fault_to_json(const look_t *looks, const fault_t *fault);

/** Puts the look into a diagnosis: key "look", and the faults in front of "findings". */
void looks_into_diagnosis(json_t *diagnosis, const look_t *looks, size_t count, const fault_list_t *faults,
                          size_t masked);

#endif
