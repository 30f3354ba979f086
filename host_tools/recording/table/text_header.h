/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The header above a table of numbers: units, and facts such as a sample interval. */
#ifndef TEXT_HEADER_H
#define TEXT_HEADER_H

#include "recording/table/table.h"
#include "recording/table/text_fields.h"
#include "recording/table/units.h"

enum { TEXT_FIELD = UNIT_FIELD };

typedef struct {
    char text[TEXT_FIELD];
} text_field_t;

/** Whether a field above a column is a unit and no name: "s", "(ms)", "[um]", "Volt", "Sequence", or empty. */
bool text_is_unit(const char *text);

/** "(ms)", "[ms]" or "in ms" becomes "ms", in place. */
void text_bare_unit(char *unit);

/** The units that a header line alone states ("Vertical Units,V,V", "Y_Unit_Label Volts Volts"): whether a field
 * is the key of such a line. The fields behind it stand over their columns. */
bool text_is_unit_key(const char *field);

/** The same for names ("TraceName,CH1,CH2"). */
bool text_is_name_key(const char *field);

/** The same for factors ("Scale,1,20"). */
bool text_is_scale_key(const char *field);

/** Whether a field is the key of what an axis of the screen is called ("Y Label,mV"): that line has no names. */
bool text_is_label_key(const char *field);

/** Whether a field is the key of a channel's name ("Source,CH1"). */
bool text_is_source_key(const char *field);

/** A header line without what says that names or units follow, "Columns: t, x", "Units: s um". */
const char *text_behind_list_key(const char *line);

/** Facts by number, "# NAME0 = Target Position" or "UNIT1: um": `key` in small letters. Returns how many
 * there are from number `first` on without a gap, `most` at most. */
size_t text_numbered(const char *const *line, size_t lines, const char *key, size_t first, text_field_t *field,
                     size_t most);

/** The unit that a header line states for all signals, "#UNITS:V" or "Unit:(mV)": a known one of voltage or length.
 * `unit` has TEXT_FIELD characters. False: none does, or they differ. */
bool text_find_common_unit(const char *const *line, size_t lines, char *unit);

/** Header keys "displacement_unit: nm", "drive_unit = mV" and those of the other columns: sets role_unit of the table.
 */
void text_find_role_units(table_t *table, const char *const *line, size_t lines);

/** Header keys "# NAME_unit: mbar" and "# NAME_long_name: Chamber pressure" of a column that this project has written
 * beside those of a recording: its unit and its origin. */
void text_find_further(table_t *table, const char *const *line, size_t lines);

/** Looks for a sample interval or rate among the first lines of a file: "Sample Interval", "Increment", "Delta_X",
 * "dt", "Sampling rate: 10 kHz", "tInc = 2e-6" and the like. Sets interval_s and interval_origin of the table; and
 * start_s, where "Start" or "X0" stands beside it. The unit behind the number says whether it is a rate or an interval;
 * one of something else, or a number with signs between thousands, is not understood. */
void text_find_interval(table_t *table, const char *const *line, size_t lines, dialect_t dialect);

#endif
