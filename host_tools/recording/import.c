/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/import.h"
#include "recording/column_pattern.h"
#include "recording/time_axis.h"
#include "recording/units.h"
#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { NO_COLUMN = -1, ROLES = COLUMN_COUNT + 1, ROLE_TIME = COLUMN_COUNT };

typedef struct {
    const table_t *table;
    const import_options_t *options;
    import_account_t *account;
    int column[ROLES];      /* of the table; the last one is time */
    const char *why[ROLES]; /* how it was found */
    import_account_t problems;
} import_job_t;

import_options_t import_nothing_said(void) {
    const import_options_t nothing = {0};
    return nothing;
}

void import_account_add(import_account_t *account, const char *format, ...) {
    char text[500];
    va_list arguments;
    if (account == NULL) {
        return;
    }
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    account->line = reallocate(account->line, account->lines + 1, sizeof *account->line);
    account->line[account->lines++] = copy_text(text);
}

char *import_account_text(const import_account_t *account) {
    size_t length = 0;
    char *text, *at;
    for (size_t i = 0; i < account->lines; i++) {
        length += strlen(account->line[i]) + 1;
    }
    text = at = allocate(length + 1, 1);
    for (size_t i = 0; i < account->lines; i++) {
        const size_t size = strlen(account->line[i]);
        memcpy(at, account->line[i], size);
        at[size] = '\n';
        at += size + 1;
    }
    *at = '\0';
    return text;
}

void import_account_free(import_account_t *account) {
    for (size_t i = 0; i < account->lines; i++) {
        free(account->line[i]);
    }
    free(account->line);
    memset(account, 0, sizeof *account);
}

static const char *role_name(int role) {
    return role == ROLE_TIME ? "time" : column_name((column_t)role);
}

/* Names that say what a column is; in small letters and digits only. */
static const char *const known_names[ROLES][24] = {
    [COLUMN_DRIVE] = {"drive",    "command", "cmd",          "vin",  "vdrive", "drivevoltage", "input",
                      "u",        "control", "dac",          "ao",   "ao0",    "vcommand",     "excitation",
                      "stimulus", "hv",      "inputvoltage", "vcmd", "aodac",  "vout",         NULL},
    [COLUMN_DISPLACEMENT] = {"displacement", "position", "pos", "disp", "stroke", "y", "deflection", "elongation",
                             "sensor", "sensorposition", "output", "z", "actualposition", "positionactual",
                             "measuredposition", "positionmeasured", "extension", NULL},
    [COLUMN_REFERENCE] = {"reference", "ref", "setpoint", "target", "desired", "targetposition", NULL},
    [COLUMN_VOLTAGE] = {"voltage", "vpiezo", "vmon", "voltagemonitor", "measuredvoltage", "vmeas", "vact", NULL},
    [COLUMN_CURRENT] = {"current", "ipiezo", "imon", "currentmonitor", NULL},
    [COLUMN_TEMPERATURE] = {"temperature", "temp", "tempc", NULL},
    [ROLE_TIME] = {"t", "time", "times", "timestamp", "xvalue", "zeit", "temps", "seconds", "xaxis", "secs", "sec",
                   "timeaxis", "timevector", "timesec", "tsec", NULL},
};

/* The last part of "data.pos" or "group/pos". */
static const char *last_part(const char *name) {
    const char *last = strrchr(name, '/') != NULL ? strrchr(name, '/') + 1 : name;
    return strrchr(last, '.') != NULL && strrchr(last, '.')[1] != '\0' ? strrchr(last, '.') + 1 : last;
}

/* The last part of "data.pos" or "group/pos", in small letters and digits. */
static void bare_name(const char *name, char *bare, size_t room) {
    const char *last = last_part(name);
    size_t count = 0;
    for (; *last != '\0' && count + 1 < room; last++) {
        if (isalnum((unsigned char)*last)) {
            bare[count++] = (char)tolower((unsigned char)*last);
        }
    }
    bare[count] = '\0';
}

static bool is_taken(const import_job_t *job, int column) {
    for (int role = 0; role < ROLES; role++) {
        if (job->column[role] == column) {
            return true;
        }
    }
    return false;
}

/* The only column whose name's last part it is, or NO_COLUMN. */
static int find_last_part(const table_t *table, const char *said) {
    int found = NO_COLUMN;
    for (size_t i = 0; i < table->columns; i++) {
        if (strcasecmp(last_part(table->column[i].name), said) == 0) {
            if (found != NO_COLUMN) {
                return NO_COLUMN;
            }
            found = (int)i;
        }
    }
    return found;
}

/* By name, with or without its unit, as it is written before any other case; by the name's last part; by number. */
static int find_said(import_job_t *job, const char *said, int role) {
    char *end;
    const unsigned long number = strtoul(said, &end, 10);
    for (int any_case = 0; any_case < 2; any_case++) {
        int (*const compare)(const char *, const char *) = any_case != 0 ? strcasecmp : strcmp;
        for (size_t i = 0; i < job->table->columns; i++) {
            if (compare(job->table->column[i].name, said) == 0 || compare(job->table->column[i].written, said) == 0) {
                return (int)i;
            }
        }
    }
    const int by_last_part = find_last_part(job->table, said);
    if (by_last_part != NO_COLUMN) {
        return by_last_part;
    }
    for (size_t i = 0; *end == '\0' && i < job->table->columns; i++) {
        if (job->table->column[i].number == number) {
            return (int)i;
        }
    }
    import_account_add(&job->problems, "no column '%s' for %s: there are %zu columns, from '%s' to '%s'", said,
                       role_name(role), job->table->columns, job->table->column[0].name,
                       job->table->column[job->table->columns - 1].name);
    return NO_COLUMN;
}

static quantity_t quantity_of(const import_job_t *job, int column, double *scale) {
    return unit_of(job->table->column[column].unit, scale);
}

static void find_by_name(import_job_t *job, int role) {
    for (size_t n = 0; known_names[role][n] != NULL; n++) {
        for (size_t i = 0; i < job->table->columns; i++) {
            char bare[100];
            bare_name(job->table->column[i].name, bare, sizeof bare);
            if (strcmp(bare, known_names[role][n]) == 0 && !is_taken(job, (int)i)) {
                job->column[role] = (int)i;
                job->why[role] = "by its name";
                return;
            }
        }
    }
}

/* The only column left whose unit measures that. */
static void find_by_unit(import_job_t *job, int role, quantity_t wanted) {
    int found = NO_COLUMN;
    for (size_t i = 0; i < job->table->columns; i++) {
        double scale;
        if (!is_taken(job, (int)i) && quantity_of(job, (int)i, &scale) == wanted) {
            if (found != NO_COLUMN) {
                return;
            }
            found = (int)i;
        }
    }
    if (found != NO_COLUMN) {
        job->column[role] = found;
        job->why[role] = "by its unit";
    }
}

static bool rises(const double *value, size_t rows) {
    for (size_t k = 1; k < rows; k++) {
        if (!(value[k] > value[k - 1])) {
            return false;
        }
    }
    return true;
}

/* Further columns with the same times: LabVIEW writes one for each signal. */
static bool repeats_time(const import_job_t *job, int column) {
    const int time = job->column[ROLE_TIME];
    return time != NO_COLUMN && memcmp(job->table->column[time].value, job->table->column[column].value,
                                       job->table->rows * sizeof(double)) == 0;
}

static void find_by_order(import_job_t *job, int role) {
    for (size_t i = 0; i < job->table->columns; i++) {
        if (!is_taken(job, (int)i) && !repeats_time(job, (int)i)) {
            job->column[role] = (int)i;
            job->why[role] = "by its place";
            return;
        }
    }
}

static void find_columns(import_job_t *job) {
    const import_options_t *options = job->options;
    const bool no_time = options->time != NULL && strcmp(options->time, "none") == 0;
    for (int role = 0; role < ROLES; role++) {
        const char *said = role == ROLE_TIME ? (no_time ? NULL : options->time) : options->column[role];
        job->column[role] = NO_COLUMN;
        job->why[role] = "";
        if (said != NULL) {
            job->column[role] = find_said(job, said, role);
            job->why[role] = "as asked for";
        }
    }
    for (int role = 0; role < ROLES; role++) {
        const char *said = role == ROLE_TIME ? options->time : options->column[role];
        if (said == NULL) {
            find_by_name(job, role);
        }
    }
    if (options->time == NULL && job->column[ROLE_TIME] == NO_COLUMN) {
        find_by_unit(job, ROLE_TIME, QUANTITY_TIME);
        if (job->column[ROLE_TIME] == NO_COLUMN) {
            find_by_unit(job, ROLE_TIME, QUANTITY_INDEX);
        }
        if (job->column[ROLE_TIME] == NO_COLUMN && !is_taken(job, 0) &&
            rises(job->table->column[0].value, job->table->rows)) {
            job->column[ROLE_TIME] = 0;
            job->why[ROLE_TIME] = "the first column, which rises steadily";
        }
    }
    if (options->column[COLUMN_DISPLACEMENT] == NULL && job->column[COLUMN_DISPLACEMENT] == NO_COLUMN) {
        find_by_unit(job, COLUMN_DISPLACEMENT, QUANTITY_LENGTH);
    }
    if (options->column[COLUMN_DRIVE] == NULL && job->column[COLUMN_DRIVE] == NO_COLUMN) {
        if (job->column[COLUMN_VOLTAGE] != NO_COLUMN && options->column[COLUMN_VOLTAGE] == NULL) {
            job->column[COLUMN_DRIVE] = job->column[COLUMN_VOLTAGE];
            job->why[COLUMN_DRIVE] = "a voltage by its name";
            job->column[COLUMN_VOLTAGE] = NO_COLUMN;
        } else {
            find_by_unit(job, COLUMN_DRIVE, QUANTITY_VOLTAGE);
        }
    }
    for (int role = COLUMN_DRIVE; role <= COLUMN_DISPLACEMENT; role++) {
        if (options->column[role] == NULL && job->column[role] == NO_COLUMN) {
            find_by_order(job, role);
        }
        if (options->column[role] == NULL && job->column[role] == NO_COLUMN) {
            import_account_add(&job->problems, "no column is left for %s: the file has %zu", role_name(role),
                               job->table->columns);
        }
    }
}

/* One column into the recording's unit, with the range that came out. */
static void convert_column(import_job_t *job, int role, double *into) {
    static const quantity_t wanted[COLUMN_COUNT] = {
        [COLUMN_DRIVE] = QUANTITY_VOLTAGE,    [COLUMN_DISPLACEMENT] = QUANTITY_LENGTH,
        [COLUMN_REFERENCE] = QUANTITY_LENGTH, [COLUMN_VOLTAGE] = QUANTITY_VOLTAGE,
        [COLUMN_CURRENT] = QUANTITY_CURRENT,  [COLUMN_TEMPERATURE] = QUANTITY_TEMPERATURE};
    const table_column_t *column = &job->table->column[job->column[role]];
    const double said = job->options->scale[role];
    double scale = 1.0, factor, low = (double)INFINITY, high = -(double)INFINITY;
    const quantity_t found = unit_of(column->unit, &scale);
    const char *unit = unit_name(wanted[role]);
    if (found != QUANTITY_UNKNOWN && found != wanted[role] && said == 0.0) {
        import_account_add(&job->problems, "%s is column %d '%s' in %s: say how many %s that is (--%s-scale)",
                           role_name(role), (int)column->number, column->name, column->unit, unit, role_name(role));
        return;
    }
    if (found == QUANTITY_UNKNOWN && column->unit[0] != '\0' && said == 0.0) {
        import_account_add(&job->problems,
                           "%s is column %d '%s' in '%s', an unknown unit: say how many %s that is (--%s-scale)",
                           role_name(role), (int)column->number, column->name, column->unit, unit, role_name(role));
        return;
    }
    factor = scale * (said != 0.0 ? said : 1.0);
    for (size_t k = 0; k < job->table->rows; k++) {
        if (!isfinite(column->value[k])) {
            import_account_add(&job->problems, "column %d '%s' has no number in row %zu", (int)column->number,
                               column->name, k + 1);
            return;
        }
        into[k] = factor * column->value[k];
        if (!(fabs(into[k]) <= RECORDING_LARGEST)) {
            char where[40];
            if (job->table->first_line > 0) {
                (void)snprintf(where, sizeof where, "line %lu", job->table->first_line + (unsigned long)k);
            } else {
                (void)snprintf(where, sizeof where, "row %zu", k + 1);
            }
            import_account_add(&job->problems,
                               "%s: column %zu '%s', taken for %s: %g %s is not plausible: more than %g %s", where,
                               column->number, column->name, role_name(role), into[k], unit, RECORDING_LARGEST, unit);
            return;
        }
        low = fmin(low, into[k]);
        high = fmax(high, into[k]);
    }
    import_account_add(job->account, "%-12s column %zu '%s'%s%s%s (%s): %.6g to %.6g %s", role_name(role),
                       column->number, column->name, column->unit[0] != '\0' ? " in " : ", taken for ",
                       column->unit[0] != '\0' ? column->unit : unit, said != 0.0 ? ", scaled" : "", job->why[role],
                       low, high, unit);
    if (low == high && role <= COLUMN_DISPLACEMENT) {
        import_account_add(&job->problems, "column %d '%s', taken for %s, never changes", (int)column->number,
                           column->name, role_name(role));
    }
    if (role == COLUMN_DRIVE && (high - low > 5000.0 || high - low < 0.01)) {
        import_account_add(job->account,
                           "  is that plausible? The drive covers %.4g V: --drive-scale, or the amplifier's gain",
                           high - low);
    }
    if (role == COLUMN_DISPLACEMENT && (high - low > 5000.0 || high - low < 0.0005)) {
        import_account_add(job->account, "  is that plausible? The stroke is %.4g um: --displacement-scale",
                           high - low);
    }
}

/* Of several actuators the first was taken, without a choice of the user. */
static void tell_siblings(const import_job_t *job) {
    const int drive = job->column[COLUMN_DRIVE], displacement = job->column[COLUMN_DISPLACEMENT];
    char pattern[2][COLUMN_PATTERN];
    if (drive == NO_COLUMN || displacement == NO_COLUMN || job->options->column[COLUMN_DRIVE] != NULL ||
        job->options->column[COLUMN_DISPLACEMENT] != NULL) {
        return;
    }
    const size_t pairs = column_pattern_siblings(job->table, job->table->column[drive].name,
                                                 job->table->column[displacement].name, pattern);
    if (pairs > 1) {
        import_account_add(job->account,
                           "  %zu pairs of such columns: one recording of each by `hyst import --drive '%s' "
                           "--displacement '%s' -o OUT.csv`",
                           pairs, pattern[0], pattern[1]);
    }
}

bool import_table(recording_t *recording, const table_t *table, const import_options_t *options,
                  import_account_t *account, failure_t *failure) {
    import_job_t job = {.table = table, .options = options, .account = account};
    time_axis_t axis = {0};
    failure_t of_time;
    memset(recording, 0, sizeof *recording);
    if (account != NULL) {
        memset(account, 0, sizeof *account);
    }
    import_account_add(account, "%s: %s, %zu columns of %zu samples", table->source, table->kind, table->columns,
                       table->rows);
    for (size_t i = 0; i < table->notes; i++) {
        import_account_add(account, "  left out: %s", table->note[i]);
    }
    if (table->damage != NULL) {
        import_account_add(&job.problems, "%s", table->damage);
    }
    find_columns(&job);
    tell_siblings(&job);
    if (options->time == NULL || strcmp(options->time, "none") == 0 || job.column[ROLE_TIME] != NO_COLUMN) {
        const int time = job.column[ROLE_TIME];
        if (!time_axis_find(&axis, table, time, options->sample_rate_hz, &of_time)) {
            import_account_add(&job.problems, "%s", of_time.text);
        } else if (time != NO_COLUMN) {
            import_account_add(account, "%-12s column %d '%s' (%s): %s", "time", (int)table->column[time].number,
                               table->column[time].name, job.why[ROLE_TIME], axis.text);
        } else {
            import_account_add(account, "%-12s %s", "time", axis.text);
        }
    }
    recording_create(recording, table->source, axis.sample_rate_hz, table->rows);
    recording->start_s = axis.start_s;
    for (int role = 0; role < COLUMN_COUNT && job.column[COLUMN_DRIVE] != NO_COLUMN; role++) {
        if (job.column[role] != NO_COLUMN) {
            convert_column(&job, role, recording_add_column(recording, (column_t)role));
        }
    }
    if (job.problems.lines == 0) {
        time_axis_resample(&axis, recording);
        if (recording->samples < 2) {
            import_account_add(&job.problems, "fewer than two samples");
        }
    }
    time_axis_free(&axis);
    if (job.problems.lines > 0) {
        recording_free(recording);
        fail(failure, "%s: %s", table->source, job.problems.line[0]);
        for (size_t i = 1; i < job.problems.lines; i++) {
            const failure_t before = *failure;
            fail(failure, "%s; %s", before.text, job.problems.line[i]);
        }
        import_account_free(&job.problems);
        return false;
    }
    return true;
}

bool import_file(recording_t *recording, const char *path, const import_options_t *options, failure_t *failure) {
    table_t table;
    import_account_t account;
    if (!table_read(&table, path, failure)) {
        return false;
    }
    const bool good = import_table(recording, &table, options, &account, failure);
    if (good) {
        recording->understood = import_account_text(&account);
    }
    import_account_free(&account);
    table_free(&table);
    return good;
}
