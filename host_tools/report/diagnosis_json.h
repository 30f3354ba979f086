/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A diagnosis as JSON, format hyst-diagnosis-1 (docs/FORMATS.md):
 *
 *     {"format":, "recordings": [..],
 *      "given": {"nrmse_percent":, "held_out_nrmse_percent":} | null,
 *      "baseline": {"chain": [..], "nrmse_percent":, "held_out_nrmse_percent":},
 *      "findings": [{"block":, "place":, "certainty": "detected" | "isolated" | "named", "confidence": 0..1,
 *                    "parameters": {"delay_s": {"value":, "sigma":, "unit":}},
 *                    "held_out_nrmse_percent_before":, "held_out_nrmse_percent_after":, "where": {..},
 *                    "explanation":, "confusable_with": [..], "separating_excitation":}],
 *      "not_found": [{"block":, "testable":, "smallest_um": number | null,
 *                     "parameter": {"name":, "value":, "unit":} | null, "separating_excitation":, "probe":}],
 *      "remaining": {"nrmse_percent":, "held_out_nrmse_percent":, "noise_floor_percent":, "structured":, "rms_um":,
 *                    "band_hz": [from, to] | null, "outliers":, "by_level":, "levels_um": [from, to] | null,
 *                    "where": {..}},
 *      "verdict":}
 *
 * With a given chain also "refitted": [{"block":, "parameter":, "given":, "value":, "sigma":, "unit":, "changed":}],
 * its numbers that were fitted again, and, where a hysteresis of another shape took the given one's place,
 * "other_shape":
 * {"block":, "instead_of":, "held_out_nrmse_percent_with_that":}.
 * Of recordings that are too long for all of it (excerpt.h) also "used": [{"recording":, "samples":, "of_samples":,
 * "mean_of":, "time_s": [from, to]}].
 * With measured columns also "measured_columns" and, in findings, "measured" (measured_columns_text.h).
 * where: {"recording": name (of time_s and harmonics), "time_s": [[from, to], ..], "frequency_hz": [..], "drive": [..],
 * "loop":, "harmonics": {"fundamental_hz":, "numbers": [..]} (only of a periodic drive)}. Nowhere: lists are empty.
 * sigma is null where the recordings do not determine the number; given, where no model was given.
 */
#ifndef DIAGNOSIS_JSON_H
#define DIAGNOSIS_JSON_H

#include "diagnosis/account/account.h"

/** A new reference. */
json_t *diagnosis_to_json(const answer_t *answer, const account_t *account, const recording_t *recordings,
                          size_t count);

bool diagnosis_write_json(const answer_t *answer, const account_t *account, const recording_t *recordings, size_t count,
                          const char *path, failure_t *failure);

#endif
