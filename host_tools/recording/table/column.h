/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The columns of a recording that have a meaning here, as files and messages call them, and in which units. */
#ifndef COLUMN_H
#define COLUMN_H

/** Header keys of a column without a meaning here, behind its name. */
#define COLUMN_UNIT_KEY      "_unit"
#define COLUMN_LONG_NAME_KEY "_long_name"

typedef enum {
    COLUMN_DRIVE,        /**< V */
    COLUMN_DISPLACEMENT, /**< um */
    COLUMN_REFERENCE,    /**< um */
    COLUMN_VOLTAGE,      /**< V, measured at the actuator */
    COLUMN_CURRENT,      /**< A */
    COLUMN_TEMPERATURE,  /**< degC */
    COLUMN_COUNT
} column_t;

/** Name of a column as a file writes it. */
const char *column_name(column_t column);
/** Its unit: "V", "um", "A", "degC". */
const char *column_unit(column_t column);

#endif
