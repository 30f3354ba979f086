/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * What the name and the unit of a column say that it is.
 *
 * A name is taken apart into words: at blanks, signs, digits, capitals, and where known words are put together ("Vin",
 * "Sollposition", "piezo_voltage"). Each known word stands for a quantity (time, count, voltage, length, ..) or for a
 * part in the measurement (commanded, wanted, measured, an error). Words are English, German and French, some Italian
 * and Spanish, and abbreviations; accents do not matter. A unit counts where the words name no quantity. Words together
 * decide: "position" is a displacement, "target position" the reference, "position error" neither. "Monitor voltage" is
 * a measured voltage; "sensor" in V is a displacement of which the um per V are missing.
 */
#ifndef COLUMN_MEANING_H
#define COLUMN_MEANING_H

#include "recording/table/table.h"
#include "recording/table/units.h"

typedef enum {
    MEANING_UNKNOWN,
    MEANING_TIME,
    MEANING_COUNTER,          /**< numbers of samples */
    MEANING_DRIVE,            /**< what the actuator was commanded to: "command", "Vin", "Stellspannung" */
    MEANING_VOLTAGE,          /**< some voltage: the name does not say which, or only the unit is one */
    MEANING_MEASURED_VOLTAGE, /**< "monitor voltage", "Vout", "U_ist" */
    MEANING_CURRENT,
    MEANING_TEMPERATURE,
    MEANING_DISPLACEMENT,
    MEANING_REFERENCE, /**< the displacement that was wanted */
    MEANING_ERROR,     /**< a difference of two others */
    MEANING_OTHER      /**< a quantity that no recording has, or a unit that contradicts the name */
} meaning_t;

typedef enum {
    SAID_BY_UNIT, /**< the name says nothing */
    SAID_WEAKLY,  /**< one letter, or "output" */
    SAID_BY_NAME
} said_t;

typedef struct {
    meaning_t meaning;
    said_t said;         /**< what says so; of no use for MEANING_UNKNOWN */
    quantity_t quantity; /**< that the name states, where the column has no unit; else that of the unit */
    bool strange;        /**< a word of the name is not known, so that its place says nothing either */
} column_meaning_t;

column_meaning_t column_meaning(const table_column_t *column);

/** "drive", "measured voltage", "counter", "unknown" .. */
const char *meaning_text(meaning_t meaning);

/** The last part of "data.pos" or "group/pos". */
const char *column_last_part(const char *name);

#endif
