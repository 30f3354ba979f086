/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Each reading in several rows: look/held_readings.h. What the other faults are seen in (noise, lags, errors of a
 * prediction) is about the stairs then, so this one stands alone. */
#include "look/held_readings.h"

static void find(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    (void)kind;
    for (size_t i = 0; i < count; i++) {
        held_readings_t held;
        held_readings_find(looks[i].recording, &held);
        (void)held_readings_add(faults, i, &held);
    }
}

const fault_kind_t fault_held_readings = {
    .name = "held_readings",
    .order = 15,
    .text = "Each reading stands in several rows: the sensor was read less often than the file was written.",
    .statistic = "changes of the reading at multiples of that many rows, which fresh readings would have shown before",
    .change =
        "Read the sensor with each row, or write rows at its rate. `hyst diagnose` goes on with the first row of "
        "each reading; `hyst import --drop-held` writes a file of those rows, for `hyst fit`. What the look shows "
        "above of noise, lags and high frequencies is about the rows that repeat.",
    .handling = FAULT_MODELLABLE,
    .alone = true,
    .find = find};
