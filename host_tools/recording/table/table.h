/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * The contents of a file of measurements before interpretation: named columns of numbers, their units if stated, and
 * the sample rate if stated.
 *
 * Kinds of file, told apart by their first bytes and never by their name:
 *
 *     text       separated by comma, semicolon, tab, bar or blanks; decimal point or comma; with or without names,
 *                units, quotes and header lines (oscilloscopes, LabVIEW .lvm, NumPy savetxt, spreadsheets);
 *                UTF-8, UTF-16 or Latin-1; LF or CR LF. table_text.c
 *     MATLAB     .mat of versions 4, 5 and 7.3: every vector of numbers, and every column of a matrix. table_matlab.c
 *     NumPy      .npy and .npz: arrays of one or two dimensions, and structured ones. table_numpy.c
 *     HDF5       data sets of one or two dimensions, in groups, too. table_hdf5.c
 *     gzip       of any text. text_source.c. Of other kinds it is refused.
 *
 * Columns of fewer samples than the longest are omitted (and noted): they are settings, not signals.
 */
#ifndef TABLE_H
#define TABLE_H

#include "base/failure.h"
#include "recording/table/column.h"
#include "recording/table/units.h"
#include <stdbool.h>
#include <stddef.h>

typedef struct {
    char *name;    /**< never NULL; "column 3" where the file has no names */
    char *written; /**< the name as the file has it, with its unit: "V_in (mV)" */
    char *origin;  /**< its name in the file that this one was made of, if it says so; or NULL */
    char *unit;    /**< as in the file, without brackets; "" if not stated */
    double *value; /**< one value per row; not finite where a binary file has such values */
    size_t number; /**< of the column in the file, from 1 */
    bool clock;    /**< the values were written as times of day */
    bool scaled;   /**< a line of the header states a factor for them */
} table_column_t;

/** A unit that a text names, but not of which column. */
typedef struct {
    size_t line;  /**< counted from 1; 0: none */
    double scale; /**< as unit_of has it, never 1 */
} unit_hint_t;

typedef struct {
    char *source; /**< the path */
    char *kind;   /**< "text, ';' between columns, decimal comma", "MATLAB 7.3", .. */
    size_t rows, columns;
    table_column_t *column;
    double interval_s;             /**< between rows, as the file states it; 0: it does not */
    double start_s;                /**< time of row number 0, as the file states it; 0: it does not */
    char *role_unit[COLUMN_COUNT]; /**< that a header key states for a column of a recording ("drive_unit: mV"), or NULL
                                    */
    size_t interval_unread;        /**< line of an interval or a rate that is not understood, counted from 1; 0: none */
    char *interval_origin;         /**< where it is stated ("header line 3: Sample Interval"), or NULL */
    unsigned long first_line;      /**< of a text: line of row 0, counted from 1; else 0 */
    size_t passed, *passed_before; /**< of a text: lines among the data that are none, and the row behind each */
    char *damage; /**< rows that could not be read, or NULL. They hold a straight line between their neighbours, so that
                       what else is wrong shows as well; such a table makes no recording unless the caller asks for it
                     (import_table) */
    char *unnamed, *unnamed_line; /**< why words above the columns are not their names, and these words; or NULL */
    char *partial;                /**< of a text: columns that have numbers in a part of the lines only, or NULL */
    unit_hint_t unit_hint[QUANTITY_LENGTH + 1]; /**< by quantity: of times, voltages and lengths */
    size_t notes;
    char **note; /**< what was omitted, one line each */
} table_t;

/** Reads a file of any kind above. On success the caller frees *table with table_free. */
bool table_read(table_t *table, const char *path, failure_t *failure);

void table_free(table_t *table);

/** The line of a row of a text, counted from 1; 0: the file is no text. */
unsigned long table_line(const table_t *table, size_t row);

/* For the readers. */

/** An empty table of that file. */
void table_open(table_t *table, const char *path, const char *kind);
/** Adds a column, which is then the last one and has its place as number; the texts are copied (written NULL: the
 * name), value is taken over (table->rows values). */
void table_add(table_t *table, const char *name, const char *unit, const char *written, double *value);
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void table_note(table_t *table, const char *format, ...);

/** What is noted of an array behind its name: of complex numbers, and of one element. */
#define TABLE_COMPLEX    "holds complex numbers: save their real part or magnitude"
#define TABLE_ONE_NUMBER " is one number, no signal"

/** The sample interval, and where the file states it. */
void table_set_interval(table_t *table, double interval_s, const char *origin);

/** An array of a binary file: its rows are samples unless it has fewer rows than columns. Adds its columns if the table
 * has as many rows (the first array sets them; a longer one replaces what is there); else notes it. A single number
 * called like a sample rate or interval is taken for that. A unit behind the name's last underscore is its unit
 * ("pos_nm"). `value` is in rows (C order) if row_major, copied. */
void table_add_array(table_t *table, const char *name, const double *value, size_t rows, size_t columns,
                     bool row_major);

/** Where no column of times rises all the time, but one of whole seconds does together with one of their parts ("ms",
 * "nsecs"), the former becomes the sum of both, and is called so. */
void table_join_times(table_t *table);

/** What is said of a file without any signal that has objects of MATLAB. */
#define MATLAB_OBJECTS "; objects of MATLAB classes (table, timeseries) are not read: save their columns as arrays"

bool table_read_text(table_t *table, const char *path, failure_t *failure);
bool table_read_matlab(table_t *table, const char *path, failure_t *failure);
bool table_read_numpy(table_t *table, const char *path, failure_t *failure);
bool table_read_numpy_archive(table_t *table, const char *path, failure_t *failure);
bool table_read_hdf5(table_t *table, const char *path, failure_t *failure);

#endif
