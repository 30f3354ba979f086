/* SPDX-License-Identifier: GPL-3.0-or-later */
/* An instant from which on the readings have another gain or offset: look/path/switches.h. One whose gain did not
 * change is a sensor that was set to zero again (sensor_rezero). */
#include "look/fault.h"
#include <math.h>

static bool gain_changed(const switch_t *change) {
    return change->gain_sigma > 0.0;
}

static void find_kind(const look_t *looks, size_t count, const fault_kind_t *kind, bool gain, fault_list_t *faults) {
    for (size_t i = 0; i < count; i++) {
        for (size_t s = 0; s < looks[i].changes.switches; s++) {
            const switch_t *change = &looks[i].changes.change[s];
            if (gain_changed(change) != gain) {
                continue;
            }
            fault_t *fault =
                fault_add(faults, kind, i, looks[i].changes.before_um / looks[i].changes.left_um, change->log_chance);
            if (fault != NULL) {
                if (gain) {
                    fault_number(fault, "gain", "1", change->gain, change->gain_sigma);
                }
                fault_number(fault, "offset_um", "um", change->offset_um, change->offset_sigma_um);
                fault_number(fault, "at_s", "s", (double)change->at / looks[i].recording->sample_rate_hz,
                             (double)(change->within + 1) / looks[i].recording->sample_rate_hz);
                fault_span(fault, change->at - change->within, change->at + change->within + 1);
            }
        }
    }
}

static void find_switch(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    find_kind(looks, count, kind, true, faults);
}

static void find_rezero(const look_t *looks, size_t count, const fault_kind_t *kind, fault_list_t *faults) {
    find_kind(looks, count, kind, false, faults);
}

/* The one that this fault is. */
static double undo(const fault_t *fault, const look_t *look, recording_t *recording) {
    double log_gain = 0.0;
    for (size_t s = 0; s < look->changes.switches; s++) {
        const switch_t *change = &look->changes.change[s];
        if (change->at - change->within == fault->span[0].from) {
            double *y = recording->column[COLUMN_DISPLACEMENT];
            for (size_t k = change->at; k < recording->samples; k++) {
                y[k] = (y[k] - change->offset_um) / change->gain;
            }
            log_gain += (double)(recording->samples - change->at) * log(change->gain);
        }
    }
    return log_gain;
}

#define SWITCH_STATISTIC "what the reference leaves before, over what it leaves after gain and offset are set right"

const fault_kind_t fault_gain_switch = {
    .name = "gain_switch",
    .order = 140,
    .text = "At one instant the readings take on another gain, and keep it.",
    .statistic = SWITCH_STATISTIC,
    .change =
        "Fix the sensor's range before recording. An actuator that was driven too far backwards (depoled) shows the "
        "same: repeat a path from before. Fit the parts apart, or divide the second by its gain.",
    .handling = FAULT_MODELLABLE,
    .find = find_switch,
    .undo = undo};

const fault_kind_t fault_sensor_rezero = {
    .name = "sensor_rezero",
    .order = 150,
    .text = "At one instant the readings jump by a constant, and keep it, though the drive did nothing.",
    .statistic = SWITCH_STATISTIC,
    .change =
        "Set the sensor to zero before recording only; look for a mount that slipped. Fit the parts apart, or take "
        "the offset off.",
    .handling = FAULT_MODELLABLE,
    .find = find_rezero,
    .undo = undo};
