/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What an open amplifier consists of: for device.c, opening.c, restart.c and arming.c, which share it. Others use their
 * functions.
 */
#ifndef DEVICE_STATE_H
#define DEVICE_STATE_H

#include "amplifier/device/device_type.h"
#include "amplifier/line/serial_line.h"
#include "registers/register_table.h"

struct device {
    serial_line_t line;
    int64_t identity[REGISTER_COUNT]; /* magic to serial_low are filled */
    bool map_known;                   /* otherwise identity has magic and abi alone */
    unsigned unlocked;                /* by device_unlock */
    bool keys_stay;                   /* another master drives with keys that it has written */
    int64_t seen[REGISTER_COUNT];     /* starts, events and sequence, as last read: the last two only grow in a start */
    bool starts_known;
    bool armed;                                         /* by device_arm, and not disarmed here since */
    void (*left_fault)(void *context, int64_t tripped); /* or NULL; see device_when_left_fault */
    void *left_fault_context;
};

#endif
