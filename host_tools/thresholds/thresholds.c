/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "thresholds/thresholds.h"

/* Another table of the same rows, for what only asks how much depends on them (tests/proof/thresholds). */
#ifndef THRESHOLDS_TABLE
#define THRESHOLDS_TABLE "thresholds/thresholds.def"
#endif

#define TOPIC(topic)
#define THRESHOLD(name, moved, value, unit, why, lower, higher) value,
const thresholds_t threshold = {
#include THRESHOLDS_TABLE
};
#undef THRESHOLD
#undef TOPIC

#define TOPIC(topic)                                            {topic, NULL, WHOLE, 0.0, NULL, NULL, NULL, NULL},
#define THRESHOLD(name, moved, value, unit, why, lower, higher) {NULL, #name, moved, value, unit, why, lower, higher},
const threshold_row_t threshold_rows[] = {
#include THRESHOLDS_TABLE
};
#undef THRESHOLD
#undef TOPIC

const size_t threshold_row_count = sizeof threshold_rows / sizeof threshold_rows[0];
