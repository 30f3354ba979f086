/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/column.h"

const char *column_name(column_t column) {
    static const char *const names[COLUMN_COUNT] = {"drive",   "displacement", "reference",
                                                    "voltage", "current",      "temperature"};
    return names[column];
}

const char *column_unit(column_t column) {
    static const char *const units[COLUMN_COUNT] = {"V", "um", "um", "V", "A", "degC"};
    return units[column];
}
