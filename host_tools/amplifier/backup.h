/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Everything that can be set in an amplifier, as JSON (format hyst-backup-1, docs/FORMATS.md): the parameter image in
 * force and the registers that hold settings. Not what moves: command, mode, setpoint.
 */
#ifndef BACKUP_H
#define BACKUP_H

#include "amplifier/device/device.h"
#include <jansson.h>

/** A new reference, or NULL. */
json_t *backup_read(device_t *device, failure_t *failure);

/** What a restore did. */
typedef struct {
    bool image;       /**< one was written */
    bool watchdog;    /**< the backup has one, which was left out: it is of a hyst that kept it */
    size_t settings;  /**< registers written, and read back the same */
    size_t not_there; /**< registers of the backup that this amplifier's firmware, or this command, does not have */
} backup_done_t;

/**
 * Checks the whole backup, values that fit into no register included, then writes the image and the settings, and reads
 * them back. What the amplifier refuses after that is a failure that says what is in force. It goes in whatever limits
 * are in force: lower and upper ones are written together. `where` stands for the file in messages.
 */
bool backup_write(device_t *device, const json_t *backup, const char *where, backup_done_t *done, failure_t *failure);

#endif
