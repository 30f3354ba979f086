/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/import.h"
#include "recording/column_choice.h"
#include "recording/column_pattern.h"
#include "recording/table/units.h"
#include "recording/time_axis.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const table_t *table;
    const import_options_t *options;
    import_account_t *account;
    column_choice_t choice;
    import_account_t problems;
} import_job_t;

/* What times in ms make of rates up to 10 kHz, where they are taken for s. */
static const double slowest_hz = 10.0;

import_options_t import_nothing_said(void) {
    const import_options_t nothing = {0};
    return nothing;
}

/* The unit of a column: its own, or that of a header key such as displacement_unit; two that differ are a problem. */
static const char *unit_for(import_job_t *job, int role) {
    const table_column_t *column = &job->table->column[job->choice.column[role]];
    const char *key = job->table->role_unit[role];
    if (key == NULL || column->unit[0] == '\0') {
        return key != NULL ? key : column->unit;
    }
    double scale[2];
    const quantity_t quantity = unit_of(key, &scale[0]);
    if (unit_of(column->unit, &scale[1]) != quantity || scale[0] != scale[1]) {
        import_account_add(&job->problems, "column %zu '%s' is in %s, and header key %s_unit says '%s': one of them",
                           column->number, column->name, column->unit, role_name(role), key);
    }
    return column->unit;
}

/* What says that the numbers are a part of what the column is called; NULL: nothing does. A path of a binary file may
 * end with a number. */
static const char *states_scale(const import_job_t *job, int role) {
    const bool volts = role == COLUMN_DRIVE || role == COLUMN_VOLTAGE;
    const table_column_t *const column = &job->table->column[job->choice.column[role]];
    return column->scaled                                                            ? "for which the header"
           : unit_states_scale(column->written, volts && job->table->first_line > 0) ? "whose name"
                                                                                     : NULL;
}

/* What a scale is for: of "mV" it is 1 V, since units with a prefix are converted before. */
static const char *scaled_by(quantity_t quantity, double scale, char text[20]) {
    (void)snprintf(text, 20, scale != 1.0 ? "1 %s" : "that", unit_name(quantity));
    return text;
}

/* What one unit of the column is in that of the role; 0: not known, which is a problem. */
static double factor_for(import_job_t *job, int role, const char *stated) {
    static const quantity_t wanted[COLUMN_COUNT] = {
        [COLUMN_DRIVE] = QUANTITY_VOLTAGE,    [COLUMN_DISPLACEMENT] = QUANTITY_LENGTH,
        [COLUMN_REFERENCE] = QUANTITY_LENGTH, [COLUMN_VOLTAGE] = QUANTITY_VOLTAGE,
        [COLUMN_CURRENT] = QUANTITY_CURRENT,  [COLUMN_TEMPERATURE] = QUANTITY_TEMPERATURE};
    const int index = job->choice.column[role];
    const table_column_t *column = &job->table->column[index];
    const double said = job->options->scale[role];
    const char *name = role_name(role), *unit = column_unit((column_t)role);
    double scale = 1.0;
    const quantity_t found = unit_of(stated, &scale);
    const bool asked = job->options->column[role] != NULL;
    char what[UNIT_FIELD + 40] = "";
    if (said == 0.0 && found != QUANTITY_UNKNOWN && found != wanted[role]) {
        (void)snprintf(what, sizeof what, " in %s", stated);
    } else if (said == 0.0 && found == QUANTITY_UNKNOWN && stated[0] != '\0') {
        (void)snprintf(what, sizeof what, " in '%s', an unknown unit", stated);
    } else if (said == 0.0 && stated[0] == '\0' && wanted[role] == QUANTITY_LENGTH &&
               job->choice.meaning[index].quantity == QUANTITY_VOLTAGE) {
        (void)snprintf(what, sizeof what, ", by its name a voltage");
    }
    const size_t hint = wanted[role] <= QUANTITY_LENGTH ? job->table->unit_hint[wanted[role]].line : 0;
    if (said == 0.0 && what[0] == '\0' && stated[0] == '\0' && hint > 0) {
        (void)snprintf(what, sizeof what, " without a unit, and line %zu names another than %s", hint, unit);
    }
    if (said == 0.0 && what[0] == '\0' && states_scale(job, role) != NULL) {
        (void)snprintf(what, sizeof what, ", %s states a scale", states_scale(job, role));
    }
    if (what[0] != '\0') {
        char of[20];
        import_account_add(&job->problems,
                           "%s is column %zu '%s'%s: say how many %s %s is (hyst import --%s-scale N)%s%s%s", name,
                           column->number, column->name, what, unit, scaled_by(found, scale, of), name,
                           asked ? "" : ", or name another (--", asked ? "" : name, asked ? "" : ")");
        return 0.0;
    }
    return scale * (said != 0.0 ? said : 1.0);
}

#define HOW_TO_FILL "(hyst import --fill-missing: straight lines over them)"

/* Rows of a column that hold no number, on straight lines between their neighbours; at an end, as the nearest one.
 * false: a problem, for it is not wanted or nothing is there. */
static bool fill(import_job_t *job, const table_column_t *column, double *value, size_t rows) {
    size_t count = 0, first = rows, last = rows; /* last: the row of the last number, rows: none yet */
    for (size_t k = 0; k < rows; k++) {
        count += isfinite(value[k]) ? 0 : 1;
        first = first == rows && !isfinite(value[k]) ? k : first;
    }
    if (count == 0) {
        return true;
    }
    const bool good = job->options->fill_missing && count < rows;
    import_account_add(good ? job->account : &job->problems,
                       "%scolumn %zu '%s' has no number in %zu row%s, the first is row %zu%s", good ? "  " : "",
                       column->number, column->name, count, count > 1 ? "s" : "", first + 1,
                       good                         ? ": filled"
                       : job->options->fill_missing ? ""
                                                    : " " HOW_TO_FILL);
    for (size_t k = 0; good && k < rows; k++) {
        if (isfinite(value[k])) {
            for (size_t i = last == rows ? 0 : last + 1; i < k; i++) {
                const double part = last == rows ? 1.0 : (double)(i - last) / (double)(k - last);
                value[i] = last == rows ? value[k] : value[last] + part * (value[k] - value[last]);
            }
            last = k;
        }
    }
    for (size_t k = last + 1; good && k < rows; k++) {
        value[k] = value[last];
    }
    return good;
}

/* That a column was scaled; and what the scale was for, where its unit has a prefix. */
static void tell_scale(const import_job_t *job, int role, const char *stated, char *text, size_t room) {
    const double said = job->options->scale[role];
    double scale;
    const quantity_t quantity = unit_of(stated, &scale);
    (void)snprintf(text, room, said != 0.0 ? ", scaled" : "");
    if (said != 0.0 && scale != 1.0) {
        (void)snprintf(text, room, ", scaled by %.6g %s for 1 %s", said, column_unit((column_t)role),
                       unit_name(quantity));
    }
}

/* One column into the recording's unit, with the range that came out. */
static void convert_column(import_job_t *job, int role, double *into) {
    const table_column_t *column = &job->table->column[job->choice.column[role]];
    const char *const stated = unit_for(job, role), *const unit = column_unit((column_t)role);
    const double factor = factor_for(job, role, stated);
    double low = (double)INFINITY, high = -(double)INFINITY;
    if (factor == 0.0) {
        return;
    }
    memcpy(into, column->value, job->table->rows * sizeof *into);
    if (!fill(job, column, into, job->table->rows)) {
        return;
    }
    for (size_t k = 0; k < job->table->rows; k++) {
        into[k] *= factor;
        if (!(fabs(into[k]) <= RECORDING_LARGEST)) {
            char where[40];
            if (job->table->first_line > 0) {
                (void)snprintf(where, sizeof where, "line %lu", table_line(job->table, k));
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
    char scaled[60];
    tell_scale(job, role, stated, scaled, sizeof scaled);
    import_account_add(job->account, "%-12s column %zu '%s'%s%s%s (%s): %.6g to %.6g %s", role_name(role),
                       column->number, column->name, stated[0] != '\0' ? " in " : ", taken for ",
                       stated[0] != '\0' ? stated : unit, scaled, job->choice.why[role], low, high, unit);
    if (low == high && role <= COLUMN_DISPLACEMENT) {
        import_account_add(&job->problems, "column %zu '%s', taken for %s, never changes", column->number, column->name,
                           role_name(role));
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

/* What was taken without a word in the file that says so, and what was not taken. */
static void tell_choice(const import_job_t *job) {
    char text[700];
    if (strcmp(job->choice.why[COLUMN_DRIVE], "by its place") == 0) {
        import_account_add(
            job->account,
            "  by place: no name or unit says which of the two is the drive; --drive and --displacement do");
    }
    columns_not_used(&job->choice, job->table, text, sizeof text);
    if (text[0] != '\0') {
        import_account_add(job->account, "%-12s column %s", "not used", text);
    }
}

/* Whether a column belongs to another one of the actuators that the options tell apart. */
static bool is_another_actuators(const import_options_t *options, const char *name) {
    const char *part;
    size_t length;
    for (int role = 0; role < COLUMN_COUNT; role++) {
        if (options->others[role] != NULL && column_pattern_matches(options->others[role], name, &part, &length)) {
            return true;
        }
    }
    return false;
}

/* The columns that are none of a recording's are kept beside them, as they are. */
static void keep_extras(const import_job_t *job, recording_t *recording) {
    for (size_t i = 0; i < job->table->columns; i++) {
        const table_column_t *column = &job->table->column[i];
        if (!column_is_used(&job->choice, (int)i) && !is_another_actuators(job->options, column->name)) {
            recording_add_extra(recording, column->name, column->origin != NULL ? column->origin : column->written,
                                column->clock && column->unit[0] == '\0' ? "s" : column->unit, column->value);
        }
    }
}

/* Of several actuators the first was taken, without a choice of the user. */
static void tell_siblings(const import_job_t *job) {
    const int drive = job->choice.column[COLUMN_DRIVE], displacement = job->choice.column[COLUMN_DISPLACEMENT];
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

/* The column before that of a role, where it holds times, or NO_COLUMN: LabVIEW and TwinCAT write a time beside each
 * signal. */
static int time_beside(const import_job_t *job, int role) {
    const int before = job->choice.column[role] - 1;
    return before >= 0 && job->choice.meaning[before].meaning == MEANING_TIME ? before : NO_COLUMN;
}

static void complain_times(import_job_t *job, const table_column_t *a, const table_column_t *b) {
    import_account_add(&job->problems,
                       "column %zu '%s' has other times than column %zu '%s', and not by the same for all rows: "
                       "resample the file, or say which are right (hyst import --time N)",
                       b->number, b->name, a->number, a->name);
}

/* Drive and displacement with separate times: how much later the displacement was sampled is kept. */
static void keep_times_apart(import_job_t *job, const time_axis_t *axis, recording_t *recording) {
    const int drive = time_beside(job, COLUMN_DRIVE), displacement = time_beside(job, COLUMN_DISPLACEMENT);
    double later_s;
    if (drive == NO_COLUMN || displacement == NO_COLUMN || job->options->time != NULL ||
        !(axis->sample_rate_hz > 0.0)) {
        return;
    }
    const table_column_t *const a = &job->table->column[drive], *const b = &job->table->column[displacement];
    if (!time_axis_later(job->table, drive, displacement, 1.0 / axis->sample_rate_hz, &later_s)) {
        complain_times(job, a, b);
    } else if (fabs(later_s) * axis->sample_rate_hz > 1e-3) { /* less is what printed digits leave */
        char text[40];
        (void)snprintf(text, sizeof text, "%.6g", later_s);
        recording_set_key(recording, "displacement_sampled_after_s", text);
        import_account_add(job->account,
                           "  the displacement's times, column %zu '%s', are later than the drive by %s s: kept",
                           b->number, b->name, text);
    }
}

/* Times that are not used, and go at another rate than those that are: which signals do they belong to? */
static void check_other_times(import_job_t *job) {
    const int time = job->choice.column[ROLE_TIME];
    if (time == NO_COLUMN || job->options->time != NULL || job->choice.meaning[time].meaning != MEANING_TIME) {
        return;
    }
    const table_column_t *const a = &job->table->column[time];
    for (size_t i = 0; i < job->table->columns; i++) {
        const table_column_t *const b = &job->table->column[i];
        double scale;
        if (column_is_used(&job->choice, (int)i) || job->choice.meaning[i].meaning != MEANING_TIME || b->clock ||
            a->clock || unit_of(a->unit, &scale) != unit_of(b->unit, &scale)) {
            continue;
        }
        if (time_axis_is_other(job->table, time, (int)i)) {
            complain_times(job, a, b);
            return;
        }
    }
}

/* One signal twice, as loggers write it raw and scaled: no actuator follows its drive so closely. */
static void check_copies(const import_job_t *job, const recording_t *recording) {
    const double *u = recording->column[COLUMN_DRIVE], *y = recording->column[COLUMN_DISPLACEMENT];
    const size_t rows = recording->samples;
    size_t low = 0, high = 0;
    if (u == NULL || y == NULL || rows < 3) {
        return;
    }
    for (size_t k = 1; k < rows; k++) {
        low = u[k] < u[low] ? k : low;
        high = u[k] > u[high] ? k : high;
    }
    const double slope = (y[high] - y[low]) / (u[high] - u[low]), offset = y[low] - slope * u[low];
    double worst = 0.0;
    for (size_t k = 0; k < rows; k++) {
        worst = fmax(worst, fabs(y[k] - offset - slope * u[k]));
    }
    /* 1e-4 of the range: more than printed digits leave, less than any piezo, its sensor or its amplifier. */
    if (worst <= 1e-4 * fabs(y[high] - y[low])) {
        import_account_add(job->account,
                           "  is that plausible? The displacement is the drive times %.6g, plus %.6g: the same signal "
                           "twice, or a simulation",
                           slope, fabs(offset) <= worst ? 0.0 : offset);
    }
}

/* Columns are not taken by place where words above them may say something else. */
static void check_unnamed(import_job_t *job) {
    const table_column_t above = {.name = job->table->unnamed_line, .unit = (char[]){""}};
    bool by_place = false;
    for (int role = COLUMN_DRIVE; role <= COLUMN_DISPLACEMENT; role++) {
        by_place = by_place || (job->choice.column[role] != NO_COLUMN && job->options->column[role] == NULL);
    }
    if (job->table->unnamed != NULL && by_place && column_meaning(&above).meaning != MEANING_UNKNOWN) {
        import_account_add(&job->problems,
                           "%s, so what is what is not known: say it by number (hyst import --time N --drive N "
                           "--displacement N)",
                           job->table->unnamed);
    }
}

/* Without times nothing else says that segments stand below each other, or a row of means below the data. Where every
 * line is followed by an empty one, that is how the file is written. */
static void tell_breaks(const import_job_t *job) {
    const table_t *const table = job->table;
    if (table->passed > 0 && table->passed < table->rows / 2) {
        import_account_add(job->account,
                           "  is that plausible? %zu empty line%s or remark%s among the data, the first before line "
                           "%lu: what stands around them is taken for one run",
                           table->passed, table->passed > 1 ? "s" : "", table->passed > 1 ? "s" : "",
                           table_line(table, table->passed_before[0]));
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
    if (table->damage != NULL && options->fill_missing) {
        import_account_add(account, "  filled with straight lines: %s", table->damage);
    } else if (table->damage != NULL) {
        import_account_add(&job.problems, "%s " HOW_TO_FILL, table->damage);
    }
    columns_choose(&job.choice, table, options, &job.problems);
    tell_siblings(&job);
    if (options->time == NULL || strcmp(options->time, "none") == 0 || job.choice.column[ROLE_TIME] != NO_COLUMN) {
        const int time = job.choice.column[ROLE_TIME];
        const bool counts = time != NO_COLUMN && job.choice.meaning[time].meaning == MEANING_COUNTER;
        if (!time_axis_find(&axis, table, time, counts, options->sample_rate_hz, &of_time)) {
            import_account_add(&job.problems, "%s", of_time.text);
        } else if (axis.unit_taken && table->unit_hint[QUANTITY_TIME].line > 0) {
            import_account_add(&job.problems,
                               "time is column %zu '%s' without a unit, and line %zu names another than s: say the "
                               "rate (hyst import --sample-rate: %.9g or %.9g)",
                               table->column[time].number, table->column[time].name,
                               table->unit_hint[QUANTITY_TIME].line, axis.sample_rate_hz,
                               axis.sample_rate_hz / table->unit_hint[QUANTITY_TIME].scale);
        } else if (time != NO_COLUMN) {
            import_account_add(account, "%-12s column %d '%s'%s (%s): %s", "time", (int)table->column[time].number,
                               table->column[time].name, axis.unit_taken ? ", taken for s" : "",
                               job.choice.why[ROLE_TIME], axis.text);
            if (axis.unit_taken && axis.sample_rate_hz < slowest_hz) {
                import_account_add(account, "  is that plausible? Where the times are ms: --sample-rate %.9g",
                                   1e3 * axis.sample_rate_hz);
            }
        } else {
            import_account_add(account, "%-12s %s", "time", axis.text);
            tell_breaks(&job);
        }
    }
    recording_create(recording, table->source, axis.sample_rate_hz, table->rows);
    recording->start_s = axis.start_s;
    for (int role = 0; role < COLUMN_COUNT && job.choice.column[COLUMN_DRIVE] != NO_COLUMN; role++) {
        if (job.choice.column[role] != NO_COLUMN) {
            convert_column(&job, role, recording_add_column(recording, (column_t)role));
        }
    }
    const size_t complaints = job.problems.lines;
    keep_times_apart(&job, &axis, recording);
    if (job.problems.lines == complaints) {
        check_other_times(&job);
    }
    check_unnamed(&job);
    if (job.problems.lines == 0) {
        check_copies(&job, recording);
        keep_extras(&job, recording);
    }
    tell_choice(&job);
    column_choice_free(&job.choice);
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
        recording_take_keys(recording, path);
    }
    import_account_free(&account);
    table_free(&table);
    return good;
}
