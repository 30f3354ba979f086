/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "base/output_file.h"
#include "base/shown_name.h"
#include "command_line/recording_output.h"
#include "commands/command.h"
#include "look/held_readings.h"
#include "look/summary.h"
#include "recording/import_several.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int import(int argc, char **argv);

const command_t command_import = {
    .name = "import",
    .order = 5,
    .arguments = "FILE [-o OUT.csv] [--time C] [--drive C] [--displacement C] [--sample-rate HZ] ..",
    .summary = "Read a file of measurements from elsewhere and write a recording",
    .details =
        "FILE is text (any separator, decimal point or comma; oscilloscope and LabVIEW exports), MATLAB .mat, NumPy\n"
        ".npy or .npz, HDF5, or gzip of a text. Without -o it only says what it understands: do that first. A name "
        "OUT\n"
        "that ends in .h5, .hdf5 or .nc makes HDF5, which keeps the columns that are not used as well.\n"
        "C is the name of a column or its number, from 1. Units in names are converted to s, V and um, so that a "
        "scale\n"
        "is per V or um, where the column is in mV or nm, too: --drive-scale 20 where the drive was recorded before "
        "an\n"
        "amplifier with a gain of 20, --displacement-scale 5 where a sensor gives 1 V for 5 um. fit, simulate and\n"
        "diagnose read the same files where nothing needs to be said about them. Of several actuators in a file,\n"
        "--drive 'V*' --displacement 'X*' takes those of V1 and X1, V2 and X2 ..: OUT.csv is then OUT-1.csv, OUT-2.csv "
        "..",
    .run = import,
    .files = FILE_RECORDING "FILE: text, MATLAB, NumPy, HDF5, or gzip of a text.\n",
    .examples = "# What is understood of an export? Nothing is written\n"
                "hyst import scope.csv\n"
                "# Name the columns, and write a recording\n"
                "hyst import scope.csv --drive CH1 --displacement CH2 -o recording.csv\n"
                "# Several actuators in one file: one recording of each\n"
                "hyst import stages.csv --drive 'V*' --displacement 'X*' -o stage.csv\n"};

static void print_columns(const table_t *table) {
    printf("columns:\n");
    for (size_t i = 0; i < table->columns; i++) {
        const table_column_t *column = &table->column[i];
        printf("  %2zu '%s'%s%s: %.6g, %.6g .. %.6g\n", column->number, column->name,
               column->unit[0] != '\0' ? " in " : "", column->unit, column->value[0], column->value[1],
               column->value[table->rows - 1]);
    }
}

static json_t *columns_to_json(const table_t *table) {
    json_t *columns = json_array();
    for (size_t i = 0; i < table->columns; i++) {
        const table_column_t *column = &table->column[i];
        json_array_append_new(columns, json_pack("{s:I, s:s, s:s}", "number", (json_int_t)column->number, "name",
                                                 column->name, "unit", column->unit));
    }
    return columns;
}

/* What was understood. recording: NULL if only the columns are listed. */
static json_t *to_json(const char *path, const table_t *table, const import_account_t *account,
                       const recording_t *recording, const summary_t *holds, const char *output) {
    json_t *understood = json_array();
    for (size_t i = 0; i < account->lines; i++) {
        json_array_append_new(understood, json_string(account->line[i]));
    }
    json_t *json =
        json_pack("{s:s, s:s, s:s, s:I, s:o, s:o, s:s?}", "format", "hyst-import-1", "file", shown_name(path), "kind",
                  table->kind, "rows", (json_int_t)table->rows, "columns", columns_to_json(table), "understood",
                  understood, "recording", output != NULL ? shown_name(output) : NULL);
    if (recording != NULL) {
        json_object_set_new(json, "samples", json_integer((json_int_t)recording->samples));
        json_object_set_new(json, "sample_rate_hz", json_real(recording->sample_rate_hz));
        json_object_set_new(json, "kept", output != NULL ? extras_to_json(recording, output) : json_null());
        json_object_set_new(json, "holds", holds != NULL ? summary_to_json(holds) : json_null());
    }
    return json;
}

/* What was said of the files. */
typedef struct {
    import_options_t columns;
    bool drop_held;
} wishes_t;

/* Of readings that stand in several rows each, the first. Refused where there are none, or too few. */
static bool drop_held(const char *path, recording_t *recording, import_account_t *account, failure_t *failure) {
    held_readings_t held;
    held_readings_find(recording, &held);
    if (held.rows == 0) {
        return fail(failure,
                    "%s: no reading stands in several rows, or too few do to say so: --drop-held has nothing "
                    "to drop",
                    path);
    }
    if (!held_readings_undo(recording, 1, &held)) {
        return fail(failure, "%s: too few samples are left of %zu rows a reading", path, held.rows);
    }
    import_account_add(account, "readings     each in %zu rows: the first of them is kept, from row %zu of the data on",
                       held.rows, held.first + 1);
    return true;
}

/* One recording. *json: what --json prints of it, a new reference; NULL: not wanted. */
static bool import_one(const char *path, const table_t *table, const wishes_t *wishes, const char *output, bool as_json,
                       json_t **json, failure_t *failure) {
    recording_t recording;
    import_account_t account = {0};
    bool good = import_table(&recording, table, &wishes->columns, &account, failure);
    if (good && wishes->drop_held && !drop_held(path, &recording, &account, failure)) {
        recording_free(&recording);
        good = false;
    }
    for (size_t i = 0; text_wanted(as_json) && i < account.lines; i++) {
        puts(account.line[i]);
    }
    if (good) {
        summary_t holds;
        failure_t too_short;
        const bool looked = summary_make(&recording, &holds, &too_short);
        if (looked && text_wanted(as_json)) {
            summary_print(stdout, &holds);
        }
        if (output != NULL) {
            recording_take_keys(&recording, path);
        }
        recording_set_key(&recording, "imported_from", shown_name(path));
        good = recording_check_keys(&recording, failure) &&
               (output == NULL || recording_write(&recording, output, failure));
        *json = good && as_json ? to_json(path, table, &account, &recording, looked ? &holds : NULL, output) : NULL;
        if (good && output != NULL && text_wanted(as_json)) {
            printf("%s: %zu samples at %.9g Hz\n", shown_name(output), recording.samples, recording.sample_rate_hz);
            extras_print(stdout, &recording, output);
        }
        recording_free(&recording);
    }
    import_account_free(&account);
    return good;
}

/* "OUT-WHICH.csv". To be freed. */
static char *output_of(const char *output, const char *which) {
    const char *dot = strrchr(output, '.'), *slash = strrchr(output, '/');
    const size_t stem = dot != NULL && (slash == NULL || dot > slash) ? (size_t)(dot - output) : strlen(output);
    const size_t room = strlen(output) + strlen(which) + 2;
    char *name = allocate(room, 1);
    (void)snprintf(name, room, "%.*s-%s%s", (int)stem, output, which, output + stem);
    for (size_t i = stem; i < stem + 1 + strlen(which); i++) {
        name[i] = name[i] == '/' ? '-' : name[i];
    }
    return name;
}

/* One recording of each actuator. */
static bool import_each(const char *path, const table_t *table, const wishes_t *wishes, const char *output,
                        bool as_json, json_t **json, failure_t *failure) {
    import_actuator_t *actuator;
    size_t count;
    if (!import_actuators(table, &wishes->columns, &actuator, &count, failure)) {
        return false;
    }
    char **name = allocate(count, sizeof *name);
    json_t *each = json_array();
    for (size_t i = 0; i < count && output != NULL; i++) {
        name[i] = output_of(output, actuator[i].which);
    }
    bool good = output_files_check((const char *const *)name, count, &path, 1, failure);
    for (size_t i = 0; good && i < count; i++) {
        json_t *one = NULL;
        const wishes_t of_one = {.columns = actuator[i].options, .drop_held = wishes->drop_held};
        good = import_one(path, table, &of_one, name[i], as_json, &one, failure);
        if (one != NULL) {
            json_array_append_new(each, one);
        }
    }
    *json = json_pack("{s:s, s:s, s:o}", "format", "hyst-imports-1", "file", shown_name(path), "recordings", each);
    for (size_t i = 0; i < count; i++) {
        free(name[i]);
    }
    free(name);
    import_actuators_free(actuator, count);
    return good;
}

static bool run(const char *path, const wishes_t *wishes, const char *output, bool list, bool as_json,
                failure_t *failure) {
    table_t table;
    json_t *json = NULL;
    bool good;
    if (!table_read(&table, path, failure)) {
        return false;
    }
    if (list && table.damage != NULL) {
        fail(failure, "%s: %s", path, table.damage);
        table_free(&table);
        return false;
    }
    if (list) {
        const import_account_t nothing = {0};
        good = !as_json || json_print(to_json(path, &table, &nothing, NULL, NULL, NULL), JSON_INDENT(1), failure);
        if (good && text_wanted(as_json)) {
            print_columns(&table);
        }
        table_free(&table);
        return good;
    }
    good = (import_is_several(&wishes->columns) ? import_each : import_one)(path, &table, wishes, output, as_json,
                                                                            &json, failure);
    good = good && (!as_json || json_print(json_incref(json), JSON_INDENT(1), failure));
    json_decref(json);
    table_free(&table);
    return good;
}

static int import(int argc, char **argv) {
    const char *output = NULL;
    bool list = false, as_json = false;
    wishes_t wishes = {.columns = import_nothing_said()};
    const option_t options[] = {
        {.name = "--output",
         .letter = "-o",
         .kind = OPTION_OUTPUT,
         .argument = "OUT.csv",
         .help = "write the recording",
         .target = &output},
        {.name = "--list", .kind = OPTION_FLAG, .help = "only list the columns", .target = &list},
        {.name = "--time",
         .kind = OPTION_TEXT,
         .argument = "C",
         .help = "column of times, or none",
         .target = &wishes.columns.time},
        {.name = "--drive",
         .kind = OPTION_TEXT,
         .argument = "C",
         .help = "column of the drive",
         .target = &wishes.columns.column[COLUMN_DRIVE]},
        {.name = "--displacement",
         .kind = OPTION_TEXT,
         .argument = "C",
         .help = "column of the displacement",
         .target = &wishes.columns.column[COLUMN_DISPLACEMENT]},
        {.name = "--reference",
         .kind = OPTION_TEXT,
         .argument = "C",
         .help = "column of the displacement that was wanted",
         .target = &wishes.columns.column[COLUMN_REFERENCE]},
        {.name = "--voltage",
         .kind = OPTION_TEXT,
         .argument = "C",
         .help = "column of the voltage measured at the actuator",
         .target = &wishes.columns.column[COLUMN_VOLTAGE]},
        {.name = "--current",
         .kind = OPTION_TEXT,
         .argument = "C",
         .help = "column of the current",
         .target = &wishes.columns.column[COLUMN_CURRENT]},
        {.name = "--temperature",
         .kind = OPTION_TEXT,
         .argument = "C",
         .help = "column of the temperature",
         .target = &wishes.columns.column[COLUMN_TEMPERATURE]},
        {.name = "--sample-rate",
         .kind = OPTION_NONZERO,
         .argument = "HZ",
         .help = "where the file does not say it",
         .target = &wishes.columns.sample_rate_hz},
        {.name = "--fill-missing",
         .kind = OPTION_FLAG,
         .help = "straight lines over rows without a number",
         .target = &wishes.columns.fill_missing},
        {.name = "--drop-held",
         .kind = OPTION_FLAG,
         .help = "of each reading that stands in several rows, keep the first",
         .target = &wishes.drop_held},
        {.name = "--drive-scale",
         .kind = OPTION_NONZERO,
         .argument = "X",
         .help = "V per unit of the column: per V where that is mV",
         .target = &wishes.columns.scale[COLUMN_DRIVE]},
        {.name = "--displacement-scale",
         .kind = OPTION_NONZERO,
         .argument = "X",
         .help = "um per unit of the column: per V where that is mV",
         .target = &wishes.columns.scale[COLUMN_DISPLACEMENT]},
        {.name = "--reference-scale",
         .kind = OPTION_NONZERO,
         .argument = "X",
         .help = "um per unit of the column",
         .target = &wishes.columns.scale[COLUMN_REFERENCE]},
        {.name = "--voltage-scale",
         .kind = OPTION_NONZERO,
         .argument = "X",
         .help = "V per unit of the column",
         .target = &wishes.columns.scale[COLUMN_VOLTAGE]},
        {.name = "--current-scale",
         .kind = OPTION_NONZERO,
         .argument = "X",
         .help = "A per unit of the column",
         .target = &wishes.columns.scale[COLUMN_CURRENT]},
        {.name = "--temperature-scale",
         .kind = OPTION_NONZERO,
         .argument = "X",
         .help = "degC per unit of the column",
         .target = &wishes.columns.scale[COLUMN_TEMPERATURE]},
        JSON_OPTION(&as_json)};
    static const char streams[] = "/dev/fd/"; /* what "-" has become */
    size_t positionals;
    failure_t failure;
    const int status =
        options_parse(&command_import, options, sizeof options / sizeof options[0], argc, argv, 1, 1, &positionals);
    if (status != OPTIONS_RUN) {
        return status;
    }
    if (wishes.columns.sample_rate_hz < 0.0) {
        return usage_error(&command_import, "--sample-rate has to be above 0");
    }
    if (import_is_several(&wishes.columns) && output != NULL && strncmp(output, streams, strlen(streams)) == 0) {
        return usage_error(&command_import, "-o -: several recordings need names");
    }
    return run(argv[1], &wishes, output, list, as_json, &failure) ? STATUS_DONE : failure_print(&failure);
}
