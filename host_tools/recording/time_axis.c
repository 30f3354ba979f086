/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/time_axis.h"
#include "base/quantity.h"
#include "recording/table/units.h"
#include <gsl/gsl_interp.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Deviation in samples above which stamps count as uneven: the tolerance of recording.h for a printed time. */
static const double even_within = 0.25;
/* A step longer than this many typical ones is a gap, if most steps are nearly equal. So unlike the rates of two parts
 * may not be either: what is resampled between them is made up in the slow one, or lost in the fast one. */
static const double gap_from = 1.5;
/* Among uneven steps, of this many mean ones. What is lost is what the interpolation makes up within: of a sine with
 * 20, 50 and 100 samples a period 2.9, 0.2 and 0.05 % of its range, and three times that in a step of 6. Normal jitter
 * up to 0.4 of a step never makes one of 4 in 10000; a latency with an exponential tail of 0.4 does. A test for what
 * the other steps make unlikely saw the loss of two samples beside jitter of 0.15, but refused what does no harm. */
static const double gap_in_jitter = 4.0;
/* Steps over which jitter averages out, so that their mean is the rate there; of short files a quarter. In files of 300
 * and 3000 rows with normal jitter up to 0.4 of a step, or a tail of 0.3, no rate of 100 was said to change. Each
 * was that is 1.6 times as high in one half. In 40 rows jitter of 0.3 was refused 7 times of 100. */
enum { LOCAL_STEPS = 64, FEWEST_LOCAL_STEPS = 4 };
/* Relative tolerance between a stated rate and that of the stamps: clocks and printed digits differ by less, wrong
 * units by more. */
static const double rate_tolerance = 0.005;

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median_step(const double *stamp, size_t rows) {
    double *step = allocate(rows - 1, sizeof *step), median;
    for (size_t k = 1; k < rows; k++) {
        step[k - 1] = stamp[k] - stamp[k - 1];
    }
    qsort(step, rows - 1, sizeof *step, compare);
    median = step[(rows - 1) / 2];
    free(step);
    return median;
}

/* The number of fewest digits within a relative tolerance. */
static double fewest_digits(double value, double tolerance) {
    for (int digits = 1; digits < 15; digits++) {
        char text[40];
        double rounded;
        snprintf(text, sizeof text, "%.*g", digits, value);
        rounded = strtod(text, NULL);
        if (fabs(rounded - value) <= tolerance * value) {
            return rounded;
        }
    }
    return value;
}

/* Largest distance of stamps from even ones, in steps. */
static double unevenness(const double *stamp, size_t rows, double step) {
    double worst = 0.0;
    for (size_t k = 0; k < rows; k++) {
        worst = fmax(worst, fabs(stamp[k] - stamp[0] - (double)k * step) / step);
    }
    return worst;
}

/* Row of a table as its reader counts: line of a text, else row. */
static void where(const table_t *table, size_t row, char *text, size_t room) {
    if (table->first_line > 0) {
        snprintf(text, room, "line %lu", table_line(table, row));
    } else {
        snprintf(text, room, "row %zu", row + 1);
    }
}

/* Clocks begin anew at midnight, counters at 2^32: what a time then goes back by, in the column's unit. */
static const double day_s = 86400.0, counts_of_32_bits = 4294967296.0;

/* Where stamps go back by what a clock or a counter does when it begins anew, all later ones are moved. Only there: the
 * step that comes out has to be like the others. Returns the row of the first one, 0: none. */
static size_t unwrap(double *stamp, size_t rows, double period, double step) {
    size_t first = 0;
    double moved = 0.0;
    for (size_t k = 1; k < rows; k++) {
        const double d = stamp[k] + moved - stamp[k - 1];
        if (d < 0.0 && fabs(d + period - step) <= gap_from * step) {
            moved += period;
            first = first == 0 ? k : first;
        }
        stamp[k] += moved;
    }
    return first;
}

static const double earliest_s = 1e9, latest_s = 4.1e9; /* 2001 to 2100 */
/* No piezo is sampled less often. Larger whole steps are the ticks of a clock (60 or 210 MHz of a lock-in amplifier),
 * whose count may well be that of the seconds or milliseconds since 1970. */
static const double longest_step_s = 60.0;

/* A way to write a time without its unit. */
typedef struct {
    double scale;      /* seconds of one */
    double since_1970; /* what 1970 is in it, in seconds */
    double fastest;    /* steps of fewer seconds than that, were they seconds, are no seconds; 0: any may be them */
    const char *unit, *name;
} way_t;

/* Days are written by spreadsheets and MATLAB. As seconds they would be those of hours at more than 100 kHz. */
static const way_t ways[] = {
    {1e-3, 0.0, 0.0, "ms", "milliseconds since 1970"},
    {1e-6, 0.0, 0.0, "us", "microseconds since 1970"},
    {1e-9, 0.0, 0.0, "ns", "nanoseconds since 1970"},
    {1e-7, 11644473600.0, 0.0, NULL, "100 ns each since 1601"},
    {1e-7, 62135596800.0, 0.0, NULL, "100 ns each since the year 1"},
    {86400.0, 2209161600.0, 1e-5, NULL, "days since 1900"},
    {86400.0, 62167219200.0 - 86400.0, 1e-5, NULL, "days since the year 0"},
};

/* A date by its name. */
static bool is_date(const table_column_t *column) {
    return strncasecmp(column->name, "dat", 3) == 0;
}

/* The way in which times are written that state no unit, where something else says it: a rate, or their size, which is
 * that of a date (2001 to 2100) only in one. How it is known goes into `text`; NULL: nothing says it. */
static const way_t *unsaid_way(const table_column_t *of, size_t rows, double stated_hz, char *text, size_t room) {
    const double first = of->value[0], last = of->value[rows - 1], mean = (last - first) / (double)(rows - 1);
    for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
        const way_t *way = &ways[i];
        if (way->unit != NULL && stated_hz > 0.0 && fabs(mean * way->scale * stated_hz - 1.0) <= rate_tolerance) {
            (void)snprintf(text, room, "; its rate says that they are %s", way->unit);
            return way;
        }
        if (mean * way->scale <= longest_step_s && first * way->scale - way->since_1970 >= earliest_s &&
            last * way->scale - way->since_1970 <= latest_s &&
            (way->fastest == 0.0 || mean < way->fastest || is_date(of))) {
            (void)snprintf(text, room, "; %s, as their size says", way->name);
            return way;
        }
    }
    return NULL;
}

/* Whether all stamps go on, and how many of the steps are nearly the typical one. */
static bool check_rising(const table_t *table, const double *stamp, double typical, size_t *even, failure_t *failure) {
    *even = 0;
    for (size_t k = 1; k < table->rows; k++) {
        const double d = stamp[k] - stamp[k - 1];
        if (!(d > 0.0)) {
            char text[40], after[QUANTITY_TEXT], before[QUANTITY_TEXT];
            where(table, k, text, sizeof text);
            quantity_time(after, stamp[k], fmin(typical, fabs(d)));
            quantity_time(before, stamp[k - 1], fmin(typical, fabs(d)));
            return fail(failure, "%s: time stays or goes back: %s s after %s s%s", text, after, before,
                        d < 0.0 ? "" : " (too few digits? hyst import --time none --sample-rate HZ)");
        }
        *even += fabs(d / typical - 1.0) < 0.1;
    }
    return true;
}

/* The first rows of the fastest and of the slowest part, and how long one sample is in each. */
typedef struct {
    size_t row[2];
    double step[2];
} local_rates_t;

static local_rates_t local_rates(const double *stamp, size_t rows) {
    const size_t quarter = rows / 4;
    const size_t length = quarter > LOCAL_STEPS          ? LOCAL_STEPS
                          : quarter < FEWEST_LOCAL_STEPS ? FEWEST_LOCAL_STEPS
                                                         : quarter;
    const double by_more = 1e-6; /* than digits leave: the first such part is named */
    local_rates_t found = {.step = {(double)INFINITY, 0.0}};
    for (size_t k = 0; k + length < rows; k++) {
        const double step = (stamp[k + length] - stamp[k]) / (double)length;
        if (step * (1.0 + by_more) < found.step[0]) {
            found.step[0] = step;
            found.row[0] = k;
        }
        if (step > found.step[1] * (1.0 + by_more)) {
            found.step[1] = step;
            found.row[1] = k;
        }
    }
    return found;
}

/* Two rates, or times spaced by their logarithm, are no jitter. */
static bool check_rates(const table_t *table, const double *stamp, failure_t *failure) {
    const local_rates_t of = local_rates(stamp, table->rows);
    if (!(of.step[1] > gap_from * of.step[0])) {
        return true;
    }
    const size_t first = of.row[0] < of.row[1] ? 0 : 1, second = 1 - first;
    char text[2][40];
    where(table, of.row[first], text[0], sizeof text[0]);
    where(table, of.row[second], text[1], sizeof text[1]);
    return fail(failure,
                "the sample rate changes: from %s on samples are %.4g s apart, from %s on %.4g s: resample the file to "
                "even times, or take a part of one rate",
                text[0], of.step[first], text[1], of.step[second]);
}

/* Gaps, and rates that change: neither is resampled. */
static bool check_steps(const table_t *table, const double *stamp, double typical, double mean, failure_t *failure) {
    size_t even, gap = 1;
    if (!check_rising(table, stamp, typical, &even, failure)) {
        return false;
    }
    const double longest = 10 * even >= 9 * (table->rows - 1) ? gap_from * typical : gap_in_jitter * mean;
    while (gap < table->rows && stamp[gap] - stamp[gap - 1] <= longest) {
        gap++;
    }
    /* Behind a gap it goes on as before. */
    const bool alone = gap + 1 < table->rows && stamp[gap + 1] - stamp[gap] <= longest;
    if (!alone && !check_rates(table, stamp, failure)) {
        return false;
    }
    if (gap < table->rows) {
        char text[40], from[QUANTITY_TEXT], to[QUANTITY_TEXT];
        where(table, gap, text, sizeof text);
        quantity_time(from, stamp[gap - 1], typical);
        quantity_time(to, stamp[gap], typical);
        return fail(failure, "%s: gap in time: from %s s to %s s, one sample is %.6g s", text, from, to, typical);
    }
    return true;
}

/* From stamps in seconds. */
static bool find_from_stamps(time_axis_t *axis, const table_t *table, double *stamp, double stated_hz, double period,
                             failure_t *failure) {
    const size_t rows = table->rows;
    const double typical = median_step(stamp, rows);
    const size_t anew = typical > 0.0 ? unwrap(stamp, rows, period, typical) : 0;
    double step = (stamp[rows - 1] - stamp[0]) / (double)(rows - 1), uneven;
    if (!check_steps(table, stamp, typical > 0.0 ? typical : step, step, failure)) {
        free(stamp);
        return false;
    }
    if (!(step * RECORDING_FASTEST_HZ >= 1.0)) {
        fail(failure, "times %g s apart are not plausible: more than %g Hz", step, RECORDING_FASTEST_HZ);
        free(stamp);
        return false;
    }
    uneven = unevenness(stamp, rows, step);
    /* Rounding of the first and of the last stamp tilts the line by up to twice what the others then differ. */
    axis->sample_rate_hz = fewest_digits(1.0 / step, fmin(0.01, 2.0 * fmax(uneven, 1e-6) / (double)(rows - 1)));
    axis->start_s = stamp[0];
    char first[QUANTITY_TEXT], last[QUANTITY_TEXT];
    quantity_time(first, stamp[0], step);
    quantity_time(last, stamp[rows - 1], step);
    snprintf(axis->text, sizeof axis->text, "%.30s to %.30s s, %.9g Hz", first, last, axis->sample_rate_hz);
    if (stated_hz > 0.0 && fabs(stated_hz * step - 1.0) > rate_tolerance) {
        fail(failure,
             "the time column says %.6g Hz, stated are %.6g Hz: is its unit right? (--time none: leave it out)",
             1.0 / step, stated_hz);
        free(stamp);
        return false;
    }
    if (anew > 0) {
        char text[40];
        const size_t used = strlen(axis->text);
        where(table, anew, text, sizeof text);
        snprintf(axis->text + used, sizeof axis->text - used, "; the clock begins anew at %s", text);
    }
    if (uneven > even_within) {
        const size_t used = strlen(axis->text);
        axis->stamp_s = stamp;
        snprintf(axis->text + used, sizeof axis->text - used,
                 "; stamps uneven by up to %.2f samples, resampled to even ones", uneven);
    } else {
        free(stamp);
    }
    return true;
}

/* Sample numbers go on by one, or by as many as at the beginning. */
static bool check_numbers(const table_t *table, const double *number, failure_t *failure) {
    const double step = number[1] - number[0];
    for (size_t k = 1; k < table->rows; k++) {
        if (number[k] - number[k - 1] != step || !(step > 0.0)) {
            char text[40];
            where(table, k, text, sizeof text);
            return fail(failure,
                        "%s: samples are missing: their number goes from %.9g to %.9g (--time none: ignore it)", text,
                        number[k - 1], number[k]);
        }
    }
    return true;
}

/* Whole numbers without a unit may be anything: thousandths or millionths of a second more often than seconds. */
static bool are_whole(const double *value, size_t rows) {
    for (size_t k = 0; k < rows; k++) {
        if (value[k] != floor(value[k])) {
            return false;
        }
    }
    return true;
}

static bool refuse_whole(const table_column_t *column, size_t rows, failure_t *failure) {
    const double step = (column->value[rows - 1] - column->value[0]) / (double)(rows - 1);
    return fail(
        failure,
        "column %zu '%s' are whole numbers without a unit, %.6g apart: say the rate (hyst import --sample-rate: "
        "%.6g if they are ms, %.6g if us, %.6g if s)",
        column->number, column->name, step, 1e3 / step, 1e6 / step, 1.0 / step);
}

/* Whether all values are numbers, and go on by one. */
static bool check_numeric(const table_t *table, const double *value, bool *by_one, failure_t *failure) {
    *by_one = true;
    for (size_t k = 0; k < table->rows; k++) {
        if (!isfinite(value[k])) {
            char text[40];
            where(table, k, text, sizeof text);
            return fail(failure, "%s: no time", text);
        }
        *by_one = *by_one && (k == 0 || value[k] - value[k - 1] == 1.0);
    }
    return true;
}

/* From a column of times, in its unit, or in the way that its size says. */
static bool find_from_column(time_axis_t *axis, const table_t *table, const table_column_t *of, double scale,
                             double stated_hz, failure_t *failure) {
    char how[80] = "";
    double since = 0.0;
    if (of->unit[0] == '\0' && !of->clock) {
        const way_t *const way = unsaid_way(of, table->rows, stated_hz, how, sizeof how);
        scale = way != NULL ? way->scale : 1.0;
        since = way != NULL ? way->since_1970 : 0.0;
        axis->unit_taken = way == NULL && !(stated_hz > 0.0); /* a rate agrees, or is a problem */
    }
    const double step = (of->value[table->rows - 1] - of->value[0]) / (double)(table->rows - 1);
    const bool dates = of->value[0] >= earliest_s && step <= longest_step_s;
    if (axis->unit_taken && !dates && are_whole(of->value, table->rows)) {
        return refuse_whole(of, table->rows, failure);
    }
    double *stamp = allocate(table->rows, sizeof *stamp);
    for (size_t k = 0; k < table->rows; k++) {
        stamp[k] = scale * of->value[k] - since;
    }
    const bool found =
        find_from_stamps(axis, table, stamp, stated_hz, of->clock ? day_s : scale * counts_of_32_bits, failure);
    const size_t used = strlen(axis->text);
    (void)snprintf(axis->text + used, sizeof axis->text - used, "%s", how);
    return found;
}

bool time_axis_find(time_axis_t *axis, const table_t *table, int column, bool counts, double given_rate_hz,
                    failure_t *failure) {
    const double stated = given_rate_hz > 0.0 ? given_rate_hz : table->interval_s > 0.0 ? 1.0 / table->interval_s : 0.0;
    char counter[2 * UNIT_FIELD] = "";
    if (stated > RECORDING_FASTEST_HZ) {
        return fail(failure, "a sample rate of %g Hz is not plausible: more than %g Hz", stated, RECORDING_FASTEST_HZ);
    }
    memset(axis, 0, sizeof *axis);
    if (table->rows < 2) {
        return fail(failure, "fewer than two samples");
    }
    double first = 0.0;
    if (column >= 0) {
        const table_column_t *of = &table->column[column];
        double scale;
        char ignored[80];
        const quantity_t quantity = unit_of(of->unit, &scale);
        bool by_one;
        first = of->value[0];
        if (!check_numeric(table, of->value, &by_one, failure)) {
            return false;
        }
        /* "Ticks" of a clock are times, and no numbers of samples. */
        counts = (counts && (by_one || of->unit[0] != '\0' ||
                             unsaid_way(of, table->rows, 0.0, ignored, sizeof ignored) == NULL)) ||
                 quantity == QUANTITY_INDEX;
        if (!counts && quantity != QUANTITY_TIME && of->unit[0] != '\0') {
            return fail(failure, "time is column %zu '%s' in %s, which is no unit of time: s, ms, us or min are",
                        of->number, of->name, of->unit);
        }
        if (!counts && !(by_one && stated > 0.0 && quantity == QUANTITY_UNKNOWN)) {
            return find_from_column(axis, table, of, scale, stated, failure);
        }
        if (stated > 0.0 && !check_numbers(table, of->value, failure)) {
            return false;
        }
        (void)snprintf(counter, sizeof counter, " (column %zu '%s' counts samples)", of->number, of->name);
    }
    if (!(stated > 0.0) && table->interval_unread > 0) {
        return fail(failure,
                    "no column of times, and the sample rate in line %zu is not understood%s: say it (hyst "
                    "import --time or --sample-rate)",
                    table->interval_unread, counter);
    }
    if (!(stated > 0.0)) {
        return fail(failure,
                    "neither a column of times nor a sample rate%s: say it (hyst import --time or --sample-rate)",
                    counter);
    }
    axis->sample_rate_hz = given_rate_hz > 0.0 ? stated : fewest_digits(stated, 1e-9);
    if (given_rate_hz == 0.0 && table->start_s != 0.0) {
        axis->start_s = table->start_s + first / axis->sample_rate_hz;
    }
    snprintf(axis->text, sizeof axis->text, "%s%s: %.9g Hz", column >= 0 ? "sample numbers, " : "",
             given_rate_hz > 0.0 ? "as asked for" : table->interval_origin, axis->sample_rate_hz);
    return true;
}

bool time_axis_later(const table_t *table, int first, int second, double step_s, double *later_s) {
    const table_column_t *const a = &table->column[first], *const b = &table->column[second];
    double scale[2], sum = 0.0, low = (double)INFINITY, high = -(double)INFINITY;
    (void)unit_of(a->unit, &scale[0]);
    (void)unit_of(b->unit, &scale[1]);
    for (size_t k = 0; k < table->rows; k++) {
        const double later = scale[1] * b->value[k] - scale[0] * a->value[k];
        sum += later;
        low = fmin(low, later);
        high = fmax(high, later);
    }
    *later_s = sum / (double)table->rows;
    return high - low <= even_within * step_s;
}

bool time_axis_is_other(const table_t *table, int first, int second) {
    const double *const a = table->column[first].value, *const b = table->column[second].value;
    const size_t rows = table->rows;
    double scale[2];
    for (size_t k = 1; k < rows; k++) {
        if (!(b[k] > b[k - 1])) {
            return false;
        }
    }
    (void)unit_of(table->column[first].unit, &scale[0]);
    (void)unit_of(table->column[second].unit, &scale[1]);
    const double span = scale[0] * (a[rows - 1] - a[0]), other = scale[1] * (b[rows - 1] - b[0]);
    return rows > 1 && fabs(other - span) > rate_tolerance * fabs(span);
}

void time_axis_resample(const time_axis_t *axis, recording_t *recording) {
    const size_t rows = recording->samples;
    gsl_interp *interpolation;
    gsl_interp_accel *accelerator;
    double *old;
    size_t even;
    if (axis->stamp_s == NULL || rows < 5) {
        return;
    }
    interpolation = gsl_interp_alloc(gsl_interp_akima, rows);
    accelerator = gsl_interp_accel_alloc();
    old = allocate(rows, sizeof *old);
    even = (size_t)floor((axis->stamp_s[rows - 1] - axis->stamp_s[0]) * axis->sample_rate_hz + 1e-9) + 1;
    even = even < rows ? even : rows;
    for (size_t c = 0; c < COLUMN_COUNT + recording->extras; c++) {
        double *value = c < COLUMN_COUNT ? recording->column[c] : recording->extra[c - COLUMN_COUNT].value;
        if (value != NULL) {
            memcpy(old, value, rows * sizeof *old);
            gsl_interp_init(interpolation, axis->stamp_s, old, rows);
            for (size_t k = 0; k < even; k++) {
                const double at = fmin(axis->stamp_s[0] + (double)k / axis->sample_rate_hz, axis->stamp_s[rows - 1]);
                value[k] = gsl_interp_eval(interpolation, axis->stamp_s, old, at, accelerator);
            }
        }
    }
    recording->samples = even;
    gsl_interp_free(interpolation);
    gsl_interp_accel_free(accelerator);
    free(old);
}

void time_axis_free(time_axis_t *axis) {
    free(axis->stamp_s);
    memset(axis, 0, sizeof *axis);
}
