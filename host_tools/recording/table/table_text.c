/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Tables in text. The only assumption is that most lines hold numbers in the same places. The separator and the decimal
 * sign are those that give the most columns of numbers in lines from the whole file. The data begin where lines of that
 * shape begin; above them are names, units and facts.
 */
#include "recording/table/decimal.h"
#include "recording/table/table.h"
#include "recording/table/text_fields.h"
#include "recording/table/text_header.h"
#include "recording/table/text_hints.h"
#include "recording/table/text_igor.h"
#include "recording/table/text_names.h"
#include "recording/table/text_signs.h"
#include "recording/table/text_source.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    SAMPLE_LINES = 60, /* lines that decide the dialect */
    SURE_LINES = 5,    /* this many consecutive lines of numbers are not a header */
    SMALLEST_PART = 8, /* of a file, that holds the data alone */
    TOLD_PROBLEMS = 4
};

static const dialect_t dialects[] = {{',', '.'}, {';', '.'}, {'\t', '.'}, {';', ','}, {'\t', ','},
                                     {' ', '.'}, {' ', ','}, {'|', '.'},  {'|', ','}, {',', ','}};

/* A line that is no data wherever it stands: a blank one, or a remark, "# pause", "% pause", "// pause". "#N/A" is data
 * that is missing. */
static bool is_passed_over(const char *line) {
    const char *at = line + strspn(line, " \t");
    return *at == '\0' || *at == '%' || strncmp(at, "//", 2) == 0 ||
           (at[0] == '#' && (at[1] == ' ' || at[1] == '\t' || at[1] == '\0'));
}

/* A row of a table without anything in it, as spreadsheets write hundreds of below the data. */
static bool is_empty_row(const char *line) {
    return line[strspn(line, " \t,;|\"")] == '\0';
}

/* The line before line `at`, blank ones apart, counted from 1; 0: none. */
static size_t line_above(const text_source_t *source, size_t at) {
    while (at > 0 && text_is_blank(source->line[at - 1])) {
        at--;
    }
    return at;
}

/* The columns that hold numbers in at least nine of ten of some lines. Returns how many, less the others that hold
 * anything, unless there may be words. */
static long number_columns(const char *const *lines, size_t count, dialect_t dialect, bool words, layout_t *layout) {
    size_t numbers[MOST_COLUMNS] = {0}, texts[MOST_COLUMNS] = {0};
    long score = 0;
    for (size_t i = 0; i < count; i++) {
        field_kind_t kind[MOST_COLUMNS];
        const size_t fields = text_line_shape(lines[i], dialect, kind);
        for (size_t j = 0; j < fields; j++) {
            numbers[j] += kind[j] == FIELD_NUMBER;
            texts[j] += kind[j] == FIELD_TEXT;
        }
    }
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        layout->number[j] = numbers[j] * 10 >= count * 9;
        layout->word[j] = texts[j] * 2 >= count;
        score += layout->number[j] ? 1 : layout->word[j] && !words ? -1 : 0;
    }
    layout->labels = layout->word[0];
    layout->dialect = dialect;
    return score;
}

/* Lines from there on, where a header has ended. */
static size_t sample_lines(const text_source_t *source, size_t from, const char *sample[SAMPLE_LINES]) {
    const size_t step = 1 + (source->lines - from) / SAMPLE_LINES;
    size_t count = 0;
    for (size_t i = from; i < source->lines && count < SAMPLE_LINES; i += step) {
        size_t k = i;
        while (k < source->lines && (is_passed_over(source->line[k]) || is_empty_row(source->line[k]))) {
            k++;
        }
        if (k < source->lines && (count == 0 || sample[count - 1] != source->line[k])) {
            sample[count++] = source->line[k];
        }
    }
    return count;
}

/* Whether a line is one of data: numbers where they belong, and no word before them that the others do not have. Where
 * a word stands in front of its number, in columns before those of data (Tektronix TDS), the line is one of data. */
static bool fits(const layout_t *layout, const char *line) {
    field_kind_t kind[MOST_COLUMNS];
    const size_t fields = text_line_shape(line, layout->dialect, kind);
    if (kind[0] == FIELD_TEXT && !layout->labels && layout->number[1]) {
        return false;
    }
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        if (layout->number[j] && (j >= fields || kind[j] != FIELD_NUMBER)) {
            return false;
        }
    }
    return true;
}

/* What stands around the numbers of a line, which is that of all; false: it is no line of data. */
static bool keep_around(layout_t *layout, const char *line) {
    if (!fits(layout, line)) {
        return false;
    }
    for (size_t j = 0; line != NULL && j < MOST_COLUMNS; j++) {
        const char *field;
        size_t length;
        double number;
        around_t around;
        line = text_next_field(line, layout->dialect.separator, &field, &length);
        if (layout->number[j] &&
            (text_field_kind(field, length, layout->dialect.point, &number, &around) != FIELD_NUMBER ||
             !text_around_keep(&layout->around[j], &around))) {
            return false;
        }
    }
    return true;
}

/* Whether a line has a sign that separates before others do: blanks and commas may be part of a word. */
static bool has_stronger(const char *line, char separator) {
    return (separator == ',' && strpbrk(line, ";\t|") != NULL) || (separator == ' ' && strpbrk(line, ",;\t|") != NULL);
}

/* The dialect that makes the most columns of numbers of a part of the lines; words: whatever else it makes. */
static long best_dialect(const text_source_t *source, size_t part, bool words, layout_t *layout) {
    const char *sample[SAMPLE_LINES];
    const size_t count = sample_lines(source, source->lines - source->lines / part, sample);
    layout_t *one = allocate(1, sizeof *one);
    long best = 0;
    for (size_t i = 0; count > 0 && i < sizeof dialects / sizeof dialects[0]; i++) {
        const long score = number_columns(sample, count, dialects[i], words, one);
        if (score > best && !(words && has_stronger(sample[0], dialects[i].separator))) {
            best = score;
            *layout = *one;
        }
    }
    size_t last = best > 0 ? count : 0;
    while (last > 0 && !keep_around(layout, sample[last - 1])) {
        last--;
    }
    free(one);
    return best;
}

/* Whether a line above the data is one of them that cannot be read: as many fields, numbers in some columns of numbers
 * and none in others. Where nothing fits above it, a number comes first: a header's lines begin with words. */
static bool is_broken(const text_source_t *source, const layout_t *layout, size_t fields, size_t at) {
    field_kind_t kind[MOST_COLUMNS];
    size_t numbers = 0;
    bool number_first = false;
    if (text_line_shape(source->line[at], layout->dialect, kind) != fields) {
        return false;
    }
    const char *line = source->line[at];
    for (size_t j = 0, column = 0; line != NULL && j < fields && j < MOST_COLUMNS; j++) {
        const char *field;
        size_t length;
        double number;
        around_t around;
        line = text_next_field(line, layout->dialect.separator, &field, &length);
        if (layout->number[j]) {
            /* "Unnamed: 0" is a name, where others have no word before their numbers */
            const bool is_number =
                text_field_kind(field, length, layout->dialect.point, &number, &around) == FIELD_NUMBER &&
                (around.label_length == 0 || layout->around[j].label[0] != '\0');
            number_first = number_first || (column == 0 && is_number);
            numbers += is_number ? 1 : 0;
            column++;
        }
    }
    const size_t above = line_above(source, at);
    return numbers > 0 && (number_first || (above > 0 && fits(layout, source->line[above - 1])));
}

/* The first line of data, of which those from `sure` on are some. */
static size_t first_line(const text_source_t *source, const layout_t *layout, size_t sure) {
    field_kind_t kind[MOST_COLUMNS];
    const size_t fields = text_line_shape(source->line[sure], layout->dialect, kind);
    for (size_t above = line_above(source, sure);
         above > 0 && (fits(layout, source->line[above - 1]) || is_broken(source, layout, fields, above - 1));
         above = line_above(source, sure)) {
        sure = above - 1;
    }
    return sure;
}

/* Columns that hold numbers in some of the lines, and nothing in others. */
static void find_partial(const text_source_t *source, layout_t *layout) {
    const size_t step = 1 + (layout->end - layout->begin) / SAMPLE_LINES;
    size_t numbers[MOST_COLUMNS] = {0}, texts[MOST_COLUMNS] = {0}, lines = 0;
    for (size_t i = layout->begin; i < layout->end; i += step) {
        field_kind_t kind[MOST_COLUMNS];
        const size_t fields = text_line_shape(source->line[i], layout->dialect, kind);
        for (size_t j = 0; j < fields; j++) {
            numbers[j] += kind[j] == FIELD_NUMBER;
            texts[j] += kind[j] == FIELD_TEXT;
        }
        lines++;
    }
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        layout->partial[j] = !layout->number[j] && texts[j] == 0 && numbers[j] * 10 >= lines && numbers[j] > 0;
    }
}

static bool find_layout(const text_source_t *source, const char *path, layout_t *layout, failure_t *failure) {
    size_t run = 0, first = 0;
    long best = 0;
    memset(layout, 0, sizeof *layout);
    for (size_t part = 2; best == 0 && part <= SMALLEST_PART; part *= 2) { /* a header may be longer than the data */
        best = best_dialect(source, part, false, layout);
    }
    if (best == 0) { /* more columns of words than of numbers */
        (void)best_dialect(source, 2, true, layout);
    }
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        layout->columns += layout->number[j];
    }
    if (layout->columns == 0) {
        return fail(failure, "%s: no table of numbers: line %zu is '%.60s'", path, source->lines / 2 + 1,
                    source->line[source->lines / 2]);
    }
    layout->end = source->lines;
    while (layout->end > 0 && !fits(layout, source->line[layout->end - 1])) {
        layout->end--;
    }
    layout->begin = layout->end;
    for (size_t i = 0; i < layout->end && run < SURE_LINES; i++) {
        if (is_passed_over(source->line[i])) {
            continue;
        }
        if (fits(layout, source->line[i])) {
            first = run == 0 ? i : first;
            run++;
        } else {
            run = 0;
        }
    }
    layout->begin = run > 0 ? first_line(source, layout, first) : layout->end;
    if (layout->begin < layout->end) {
        field_kind_t kind[MOST_COLUMNS];
        layout->fields = text_line_shape(source->line[layout->begin], layout->dialect, kind);
        find_partial(source, layout);
    }
    return true;
}

static void describe(table_t *table, const text_source_t *source, const layout_t *layout) {
    char text[160];
    const char separator = layout->dialect.separator;
    const char *between = separator == '\t' ? "tabs" : separator == ' ' ? "blanks" : NULL;
    const char sign[] = {'\'', separator, '\'', '\0'};
    snprintf(text, sizeof text, "%stext (%s), %s between columns, decimal %s", source->compressed ? "gzip of " : "",
             source->encoding, between != NULL ? between : sign, layout->dialect.point == '.' ? "point" : "comma");
    free(table->kind);
    table->kind = copy_text(text);
}

/* A field that is no number, or has something else around it than others; text NULL: the line has ended. */
typedef struct {
    const char *text;
    size_t length;
    const around_text_t *others; /* NULL: no number */
} odd_field_t;

/* The numbers of one line. Returns how many there are in a row, and what comes then. What is no number is none in the
 * row either; where the line ends too early, nothing is. */
static size_t read_row(const layout_t *layout, const char *line, double *row, odd_field_t *odd) {
    size_t found = 0, column = 0;
    *odd = (odd_field_t){0};
    for (size_t j = 0; line != NULL && j < MOST_COLUMNS && column < layout->columns; j++) {
        const char *field;
        size_t length;
        around_t around;
        line = text_next_field(line, layout->dialect.separator, &field, &length);
        if (layout->number[j]) {
            const bool number =
                text_field_kind(field, length, layout->dialect.point, &row[column], &around) == FIELD_NUMBER;
            const double factor = number ? text_around_factor(&layout->around[j], &around) : 0.0;
            const bool same = factor != 0.0;
            if (!same && found == column) {
                odd->text = length > 0 ? field : NULL;
                odd->length = length;
                odd->others = number ? &layout->around[j] : NULL;
            }
            found += same && found == column ? 1 : 0;
            row[column] = same ? factor * row[column] : (double)NAN;
            column++;
        }
    }
    for (size_t j = 0; column < layout->columns && j < layout->columns; j++) {
        row[j] = (double)NAN; /* a cut number is another one */
    }
    return found;
}

/* What is wrong with a line: "line 52: 'overflow' is not a number". Returns the characters, as snprintf does. */
static int tell_odd(char *text, size_t room, size_t line, const odd_field_t *odd, size_t found, size_t columns) {
    const int length = (int)(odd->length < 40 ? odd->length : 40);
    if (odd->text == NULL) {
        return snprintf(text, room, "line %zu: %zu numbers where others have %zu", line, found, columns);
    }
    if (odd->others != NULL) {
        return snprintf(text, room, "line %zu: '%.*s' where others are '%s%sN%s%s'", line, length, odd->text,
                        odd->others->label, odd->others->label[0] != '\0' ? ":" : "",
                        odd->others->unit[0] != '\0' ? " " : "", odd->others->unit);
    }
    return snprintf(text, room, "line %zu: '%.*s' is not a number%s", line, length, odd->text,
                    text_is_grouped(odd->text, odd->length) ? " (without a sign between thousands it is)" : "");
}

/* What is no number, on a line between its neighbours. The first row has all numbers. */
static void bridge(double *value, size_t rows) {
    size_t last = 0;
    for (size_t k = 1; k < rows; k++) {
        if (isfinite(value[k])) {
            const double step = (value[k] - value[last]) / (double)(k - last);
            for (size_t i = last + 1; i < k; i++) {
                value[i] = value[last] + step * (double)(i - last);
            }
            last = k;
        }
    }
}

/* Whether a line has words over all columns of numbers, no two alike: names, and not "OL;OL". */
static bool are_names(const layout_t *layout, const char *line) {
    const char *name[MOST_COLUMNS];
    size_t length[MOST_COLUMNS], count = 0;
    for (size_t j = 0; line != NULL && j < MOST_COLUMNS && count < layout->columns; j++) {
        const char *field;
        size_t size;
        double number;
        line = text_next_field(line, layout->dialect.separator, &field, &size);
        if (!layout->number[j]) {
            continue;
        }
        if (text_field_kind(field, size, layout->dialect.point, &number, NULL) != FIELD_TEXT) {
            return false;
        }
        for (size_t i = 0; i < count; i++) {
            if (length[i] == size && memcmp(name[i], field, size) == 0) {
                return false;
            }
        }
        name[count] = field;
        length[count++] = size;
    }
    return count > 1 && count == layout->columns;
}

/* A line of names among the data: another table begins, whose columns may be others. `names`: the line above the data,
 * counted from 1; 0: none. */
static bool check_one_table(const text_source_t *source, const layout_t *layout, size_t line, size_t names,
                            const char *path, failure_t *failure) {
    const char *text = source->line[line - 1];
    if (is_passed_over(text) ? !text_has_names(layout, text) : !are_names(layout, text)) {
        return true;
    }
    if (names > 0 && strcmp(source->line[names - 1], text) == 0) {
        return fail(failure, "%s: line %zu has the names of line %zu again: another table begins; keep one in a file",
                    path, line, names);
    }
    return fail(failure,
                "%s: line %zu has names again, '%.60s': another table begins; keep one in a file, or the columns of "
                "both side by side",
                path, line, text);
}

/* A line before the next row is no data. There is room for a power of two. */
static void keep_passed(table_t *table) {
    if ((table->passed & (table->passed - 1)) == 0) {
        table->passed_before =
            reallocate(table->passed_before, table->passed > 0 ? 2 * table->passed : 1, sizeof *table->passed_before);
    }
    table->passed_before[table->passed++] = table->rows;
}

/* Numbers of all lines. Every line that has not all of them is a problem; the first ones are named. */
static bool read_rows(table_t *table, const text_source_t *source, const layout_t *layout, double **value,
                      failure_t *failure) {
    size_t problems = 0, used = 0, missing = 0, longest = 0, before = 0;
    const size_t names = line_above(source, layout->begin);
    char told[600] = "";
    for (size_t i = layout->begin; i < layout->end; i++) {
        double row[MOST_COLUMNS];
        odd_field_t odd;
        if (is_passed_over(source->line[i])) {
            if (!check_one_table(source, layout, i + 1, names, table->source, failure)) {
                return false;
            }
            keep_passed(table);
            continue;
        }
        const size_t found = read_row(layout, source->line[i], row, &odd);
        for (size_t j = 0; j < layout->columns; j++) {
            value[j][table->rows] = row[j];
        }
        if (found == layout->columns) {
            missing = 0;
            table->rows++;
            continue;
        }
        if (!check_one_table(source, layout, i + 1, names, table->source, failure)) {
            return false;
        }
        before += table->rows == before ? 1 : 0;
        missing++;
        longest = missing > longest ? missing : longest;
        table->rows++;
        if (problems++ >= TOLD_PROBLEMS || used >= sizeof told) {
            continue;
        }
        if (used > 0) {
            used += (size_t)snprintf(told + used, sizeof told - used, "; ");
        }
        const int printed =
            used < sizeof told ? tell_odd(told + used, sizeof told - used, i + 1, &odd, found, layout->columns) : 0;
        used += printed > 0 ? (size_t)printed : 0;
    }
    const size_t read = table->rows - problems;
    if (problems > 0) {
        char text[700];
        (void)snprintf(text, sizeof text, "%zu of %zu lines of data cannot be read: %s%s", problems, table->rows, told,
                       problems > TOLD_PROBLEMS ? "; .." : "");
        const size_t end = strlen(text);
        if (problems > 1) {
            (void)snprintf(text + end, sizeof text - end, "; the longest run is %zu", longest);
        }
        if (read < 2) {
            return fail(failure, "%s: %s", table->source, text);
        }
        table->damage = copy_text(text);
        table->rows -= missing + before; /* at the end, in the beginning */
        for (size_t j = 0; j < layout->columns; j++) {
            memmove(value[j], value[j] + before, table->rows * sizeof **value);
            bridge(value[j], table->rows);
        }
    }
    return read >= 2 || fail(failure, "%s: the table ends after %zu rows of numbers", table->source, table->rows);
}

/* How the numbers of one column are written, in all lines. */
static text_groups_t all_groups(const text_source_t *source, const layout_t *layout, size_t column) {
    text_groups_t groups = {0};
    for (size_t i = layout->begin; i < layout->end; i++) {
        const char *at = source->line[i], *field = NULL;
        size_t length = 0;
        for (size_t j = 0; at != NULL && j <= column; j++) {
            at = text_next_field(at, layout->dialect.separator, &field, &length);
        }
        if (fits(layout, source->line[i])) {
            (void)text_groups_count(&groups, field, length);
        }
    }
    return groups;
}

/* Fields of some lines of data: what of them is whole, and whether a column of numbers is lost to signs. */
static bool check_signs(const text_source_t *source, const layout_t *layout, const char *path, failure_t *failure) {
    const size_t rows = layout->end - layout->begin, step = 1 + rows / SAMPLE_LINES;
    text_signs_t signs = {.whole = true};
    const bool commas = layout->dialect.separator == ',';
    size_t numbers[MOST_COLUMNS] = {0}, grouped[MOST_COLUMNS] = {0}, line_of[MOST_COLUMNS] = {0}, lines = 0;
    text_groups_t groups[MOST_COLUMNS] = {{0}};
    bool short_one[MOST_COLUMNS], three[MOST_COLUMNS];
    memset(short_one, 1, sizeof short_one);
    memset(three, 1, sizeof three);
    for (size_t i = layout->begin; i < layout->end; i += step) {
        const char *at = source->line[i];
        for (size_t j = 0; at != NULL && j < MOST_COLUMNS; j++) {
            const char *field;
            size_t length;
            double number;
            at = text_next_field(at, layout->dialect.separator, &field, &length);
            const bool is_number = text_field_kind(field, length, layout->dialect.point, &number, NULL) == FIELD_NUMBER;
            const size_t sign = length > 0 && (*field == '-' || *field == '+') ? 1 : 0;
            const size_t digits =
                strspn(field + sign, "0123456789") < length - sign ? strspn(field + sign, "0123456789") : length - sign;
            numbers[j] += is_number;
            if (text_is_grouped(field, length) && !is_number) {
                grouped[j]++;
                line_of[j] = i;
            }
            if (is_number && text_groups_count(&groups[j], field, length)) {
                line_of[j] = i;
            }
            signs.whole = signs.whole && (!layout->number[j] || digits + sign == length);
            short_one[j] = short_one[j] && digits + sign == length && digits <= 3;
            three[j] = three[j] && sign == 0 && digits == 3;
            signs.fields =
                (layout->number[j] || (commas && layout->word[j])) && j >= signs.fields ? j + 1 : signs.fields;
        }
        lines++;
    }
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        if (text_groups_are_even(&groups[j])) {
            groups[j] = all_groups(source, layout, j);
        }
        if ((!layout->number[j] && grouped[j] > 0 && (numbers[j] + grouped[j]) * 10 >= lines * 9) ||
            text_groups_are_thousands(&groups[j])) {
            return fail(
                failure,
                "%s: line %zu: column %zu has signs between thousands: '%.60s': export the numbers without them", path,
                line_of[j] + 1, j + 1, source->line[line_of[j]]);
        }
        signs.thousands = signs.thousands || (j > 0 && layout->number[j] && short_one[j - 1] && three[j]);
    }
    const size_t above = line_above(source, layout->begin);
    if (above > 0) {
        field_kind_t kind[MOST_COLUMNS];
        const size_t fields = text_line_shape(source->line[above - 1], layout->dialect, kind);
        while (signs.names < fields && kind[signs.names] == FIELD_TEXT) {
            signs.names++;
        }
        signs.names = signs.names == fields ? fields : 0;
    }
    const char *problem = text_signs_problem(&signs);
    return problem == NULL || fail(failure, "%s: line %zu has %zu names, and line %zu has %zu fields, %s", path, above,
                                   signs.names, layout->begin + 1, signs.fields, problem);
}

/* Columns that there is no room for. */
static void tell_beyond(table_t *table, const char *line, char separator) {
    size_t fields = 0;
    for (; line != NULL; fields++) {
        const char *field;
        size_t length;
        line = text_next_field(line, separator, &field, &length);
    }
    if (fields > MOST_COLUMNS) {
        char text[80];
        (void)snprintf(text, sizeof text, "columns %d to %zu are not read, %d are", MOST_COLUMNS + 1, fields,
                       MOST_COLUMNS);
        table_note(table, "%s", text);
        free(table->partial);
        table->partial = copy_text(text);
    }
}

bool table_read_text(table_t *table, const char *path, failure_t *failure) {
    text_source_t source;
    layout_t *layout = allocate(1, sizeof *layout);
    double **value = NULL;
    bool good = text_source_read(&source, path, failure);
    table_open(table, path, "text");
    while (good && source.lines > 0 && is_empty_row(source.line[source.lines - 1])) {
        source.lines--;
    }
    if (good && source.lines == 0) {
        good = fail(failure, "%s: empty file", path);
    }
    good = good && (!text_is_igor(&source) || text_join_igor_waves(&source, path, failure)) &&
           find_layout(&source, path, layout, failure) && check_signs(&source, layout, path, failure);
    if (good) {
        value = allocate(layout->columns, sizeof *value);
        for (size_t i = 0; i < layout->columns; i++) {
            value[i] = allocate(layout->end - layout->begin, sizeof **value);
        }
        describe(table, &source, layout);
        table->first_line = (unsigned long)layout->begin + 1;
        good = read_rows(table, &source, layout, value, failure);
        if (good) {
            text_name_columns(table, &source, layout, value);
            text_find_unit_hints(table, (const char *const *)source.line, layout->begin, layout->end, source.lines);
            text_find_role_units(table, (const char *const *)source.line, layout->begin);
            text_find_further(table, (const char *const *)source.line, layout->begin);
            text_find_interval(table, (const char *const *)source.line,
                               layout->begin + SURE_LINES < source.lines ? layout->begin + SURE_LINES : source.lines,
                               layout->dialect);
            if (text_is_igor(&source)) {
                text_find_igor_scales(table, (const char *const *)source.line, 0, source.lines);
            }
            tell_beyond(table, source.line[layout->begin], layout->dialect.separator);
            if (layout->end < source.lines && !text_is_blank(source.line[layout->end])) {
                const size_t behind = source.lines - layout->end;
                table_note(table, "%zu line%s behind the data, from line %zu: '%.60s'", behind, behind == 1 ? "" : "s",
                           layout->end + 1, source.line[layout->end]);
            }
        } else {
            for (size_t i = 0; i < layout->columns; i++) {
                free(value[i]);
            }
        }
    }
    free(value);
    free(layout);
    text_source_free(&source);
    if (!good) {
        table_free(table);
    }
    return good;
}
