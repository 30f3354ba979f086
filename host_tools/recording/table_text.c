/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * Tables in text. The only assumption is that most lines hold numbers in the same places. The separator and the decimal
 * sign are those that give the most columns of numbers in lines from the whole file. The data begin where lines of that
 * shape begin; above them are names, units and facts.
 */
#include "recording/decimal.h"
#include "recording/table.h"
#include "recording/text_header.h"
#include "recording/text_signs.h"
#include "recording/text_source.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST_COLUMNS = 256,
    SAMPLE_LINES = 60, /* lines that decide the dialect */
    SURE_LINES = 5,    /* this many consecutive lines of numbers are not a header */
    SMALLEST_PART = 8, /* of a file, that holds the data alone */
    HEADS = 3,         /* lines above the data in which names and units are looked for */
    TOLD_PROBLEMS = 4
};

typedef struct {
    char separator; /* ' ': any blanks */
    char point;
} dialect_t;

static const dialect_t dialects[] = {{',', '.'}, {';', '.'}, {'\t', '.'}, {';', ','}, {'\t', ','},
                                     {' ', '.'}, {' ', ','}, {'|', '.'},  {'|', ','}, {',', ','}};

typedef enum { FIELD_EMPTY, FIELD_NUMBER, FIELD_TEXT } field_kind_t;

/* The next field of a line, without blanks and quotes around it. Returns what comes behind the separator, NULL at the
 * end. */
static const char *next_field(const char *line, char separator, const char **field, size_t *length) {
    const char *begin = line + strspn(line, separator == '\t' ? " " : " \t"), *end;
    if (*begin == '"') {
        const char *quote = strchr(begin + 1, '"');
        if (quote != NULL) {
            *field = begin + 1;
            *length = (size_t)(quote - begin - 1);
            while (*length > 0 && **field == ' ') {
                ++*field;
                --*length;
            }
            while (*length > 0 && (*field)[*length - 1] == ' ') {
                --*length;
            }
            end = quote + 1 + strspn(quote + 1, " ");
            if (separator == ' ') {
                end += strspn(end, " \t");
                return *end == '\0' ? NULL : end;
            }
            return *end == separator ? end + 1 : NULL;
        }
    }
    if (separator == ' ') {
        *field = begin;
        *length = strcspn(begin, " \t");
        end = begin + *length;
        end += strspn(end, " \t");
        return *end == '\0' ? NULL : end;
    }
    end = strchr(begin, separator);
    *field = begin;
    *length = end != NULL ? (size_t)(end - begin) : strlen(begin);
    while (*length > 0 && ((*field)[*length - 1] == ' ' || (*field)[*length - 1] == '\t')) {
        --*length;
    }
    return end != NULL ? end + 1 : NULL;
}

static field_kind_t field_kind(const char *field, size_t length, char point, double *number) {
    const char *end;
    if (length == 0) {
        return FIELD_EMPTY;
    }
    if (decimal_read(field, point, number, &end) && end == field + length) {
        return FIELD_NUMBER;
    }
    return clock_read(field, number, &end) && end == field + length ? FIELD_NUMBER : FIELD_TEXT;
}

/* What the fields of a line are. Returns how many there are. */
static size_t line_shape(const char *line, dialect_t dialect, field_kind_t kind[MOST_COLUMNS]) {
    size_t count = 0;
    const char *at = line;
    while (at != NULL && count < MOST_COLUMNS) {
        const char *field;
        size_t length;
        double number;
        at = next_field(at, dialect.separator, &field, &length);
        kind[count++] = field_kind(field, length, dialect.point, &number);
    }
    return count;
}

static bool is_blank(const char *line) {
    return line[strspn(line, " \t")] == '\0';
}

/* The columns that hold numbers in at least nine of ten of some lines. Returns how many, less the others that hold
 * anything. */
static long number_columns(const char *const *lines, size_t count, dialect_t dialect, bool number[MOST_COLUMNS],
                           bool *labels) {
    size_t numbers[MOST_COLUMNS] = {0}, texts[MOST_COLUMNS] = {0};
    long score = 0;
    for (size_t i = 0; i < count; i++) {
        field_kind_t kind[MOST_COLUMNS];
        const size_t fields = line_shape(lines[i], dialect, kind);
        for (size_t j = 0; j < fields; j++) {
            numbers[j] += kind[j] == FIELD_NUMBER;
            texts[j] += kind[j] == FIELD_TEXT;
        }
    }
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        number[j] = numbers[j] * 10 >= count * 9;
        score += number[j] ? 1 : texts[j] * 2 >= count ? -1 : 0;
    }
    *labels = texts[0] * 2 >= count;
    return score;
}

typedef struct {
    dialect_t dialect;
    bool number[MOST_COLUMNS]; /* the columns that hold the data */
    size_t columns;            /* how many of them */
    bool labels;               /* lines of data begin with a word */
    size_t begin, end;         /* lines of data: [begin, end) */
} layout_t;

/* Lines from there on, where a header has ended. */
static size_t sample_lines(const text_source_t *source, size_t from, const char *sample[SAMPLE_LINES]) {
    const size_t step = 1 + (source->lines - from) / SAMPLE_LINES;
    size_t count = 0;
    for (size_t i = from; i < source->lines && count < SAMPLE_LINES; i += step) {
        size_t k = i;
        while (k < source->lines && is_blank(source->line[k])) {
            k++;
        }
        if (k < source->lines) {
            sample[count++] = source->line[k];
        }
    }
    return count;
}

/* Whether a line is one of data: numbers where they belong, and no word before them that the others do not have. Where
 * a word stands in front of its number, in columns before those of data (Tektronix TDS), the line is one of data. */
static bool fits(const layout_t *layout, const char *line) {
    field_kind_t kind[MOST_COLUMNS];
    const size_t fields = line_shape(line, layout->dialect, kind);
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

static bool find_layout(const text_source_t *source, const char *path, layout_t *layout, failure_t *failure) {
    size_t run = 0, first = 0;
    long best = 0;
    memset(layout, 0, sizeof *layout);
    for (size_t part = 2; best == 0 && part <= SMALLEST_PART; part *= 2) { /* a header may be longer than the data */
        const char *sample[SAMPLE_LINES];
        const size_t count = sample_lines(source, source->lines - source->lines / part, sample);
        for (size_t i = 0; count > 0 && i < sizeof dialects / sizeof dialects[0]; i++) {
            bool number[MOST_COLUMNS], labels;
            const long score = number_columns(sample, count, dialects[i], number, &labels);
            if (score > best) {
                best = score;
                layout->dialect = dialects[i];
                layout->labels = labels;
                memcpy(layout->number, number, sizeof number);
            }
        }
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
        if (is_blank(source->line[i])) {
            continue;
        }
        if (fits(layout, source->line[i])) {
            first = run == 0 ? i : first;
            run++;
        } else {
            run = 0;
        }
    }
    layout->begin = run > 0 ? first : layout->end;
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

/* The numbers of one line. Returns how many there are in a row; *word: the field that is none, NULL at the line's end.
 */
static size_t read_row(const layout_t *layout, const char *line, double *row, const char **word, size_t *length) {
    size_t found = 0;
    *word = NULL;
    for (size_t j = 0; line != NULL && j < MOST_COLUMNS && found < layout->columns; j++) {
        const char *field;
        line = next_field(line, layout->dialect.separator, &field, length);
        if (layout->number[j]) {
            if (field_kind(field, *length, layout->dialect.point, &row[found]) != FIELD_NUMBER) {
                *word = *length > 0 ? field : NULL;
                return found;
            }
            found++;
        }
    }
    return found;
}

/* `missing` rows before `row` on a line between their neighbours. The first row of data is never missing. */
static void bridge(double *value[MOST_COLUMNS], size_t columns, size_t row, size_t missing) {
    for (size_t j = 0; j < columns && missing > 0; j++) {
        const double *after = &value[j][row];
        const double step = missing < row ? (*after - value[j][row - missing - 1]) / (double)(missing + 1) : 0.0;
        for (size_t i = 1; i <= missing; i++) {
            value[j][row - i] = *after - step * (double)i;
        }
    }
}

/* Numbers of all lines. Every line that has not all of them is a problem; the first ones are named. */
static bool read_rows(table_t *table, const text_source_t *source, const layout_t *layout, double **value,
                      failure_t *failure) {
    size_t problems = 0, used = 0, missing = 0;
    char told[600] = "";
    for (size_t i = layout->begin; i < layout->end; i++) {
        double row[MOST_COLUMNS];
        const char *word;
        size_t length, found;
        int printed;
        if (is_blank(source->line[i])) {
            continue;
        }
        found = read_row(layout, source->line[i], row, &word, &length);
        if (found == layout->columns) {
            for (size_t j = 0; j < found; j++) {
                value[j][table->rows] = row[j];
            }
            bridge(value, layout->columns, table->rows, missing);
            missing = 0;
            table->rows++;
            continue;
        }
        missing++;
        table->rows++;
        if (problems++ >= TOLD_PROBLEMS || used >= sizeof told) {
            continue;
        }
        printed = word != NULL
                      ? snprintf(told + used, sizeof told - used, "%sline %zu: '%.*s' is not a number%s",
                                 used > 0 ? "; " : "", i + 1, (int)(length < 40 ? length : 40), word,
                                 text_is_grouped(word, length) ? " (without a sign between thousands it is)" : "")
                      : snprintf(told + used, sizeof told - used, "%sline %zu: %zu numbers where others have %zu",
                                 used > 0 ? "; " : "", i + 1, found, layout->columns);
        used += printed > 0 ? (size_t)printed : 0;
    }
    const size_t read = table->rows - problems;
    if (problems > 0) {
        char text[700];
        (void)snprintf(text, sizeof text, "%zu of %zu lines of data cannot be read: %s%s", problems, table->rows, told,
                       problems > TOLD_PROBLEMS ? "; .." : "");
        if (read < 2) {
            return fail(failure, "%s: %s", table->source, text);
        }
        table->damage = copy_text(text);
        table->rows -= missing; /* at the end */
    }
    return read >= 2 || fail(failure, "%s: the table ends after %zu rows of numbers", table->source, table->rows);
}

/* Splits a line of the header like the data, or by whatever makes enough fields of it. */
static size_t split_names(const char *line, char separator, size_t least, text_field_t field[MOST_COLUMNS]) {
    const char others[] = {separator, '\t', ';', ',', ' '};
    line += strspn(line, "#%/! ");
    for (size_t i = 0; i < sizeof others; i++) {
        const char *at = line;
        size_t count = 0;
        while (at != NULL && count < MOST_COLUMNS) {
            const char *text;
            size_t length;
            at = next_field(at, others[i], &text, &length);
            snprintf(field[count].text, sizeof field[count].text, "%.*s", (int)length, text);
            count++;
        }
        if (count >= least) {
            return count;
        }
    }
    return 0;
}

/* The fields of the last header line that begins with such a key, over their columns; NULL: there is none. To be
 * freed. Where the key does not stand over a column itself, the first field is that behind it. */
static text_field_t *stated(const text_source_t *source, const layout_t *layout, size_t least,
                            bool (*is_key)(const char *field)) {
    text_field_t *field = allocate(MOST_COLUMNS + 1, sizeof *field);
    for (size_t i = layout->begin; i > 0; i--) {
        size_t count = split_names(source->line[i - 1], layout->dialect.separator, least, field);
        if (count >= least && is_key(field[0].text)) {
            while (count > 0 && field[count - 1].text[0] == '\0') {
                count--;
            }
            if (count > 1 && layout->number[0] && count == least + 1) {
                memmove(field, field + 1, (MOST_COLUMNS - 1) * sizeof *field);
            } else {
                field[0].text[0] = '\0';
            }
            if (count > 1) { /* not a key alone */
                return field;
            }
        }
    }
    free(field);
    return NULL;
}

/* Names and units by number, in the order of the columns of numbers ("# NAME0 = Target Position"): each over its
 * column. NULL: not one for each. To be freed. */
static text_field_t *numbered(const text_source_t *source, const layout_t *layout, const char *key) {
    text_field_t *field = allocate(MOST_COLUMNS, sizeof *field), *over = allocate(MOST_COLUMNS, sizeof *over);
    const size_t count = text_numbered((const char *const *)source->line, layout->begin, key, field, MOST_COLUMNS);
    size_t next = 0;
    for (size_t j = 0; count == layout->columns && j < MOST_COLUMNS; j++) {
        if (layout->number[j]) {
            over[j] = field[next++];
        }
    }
    free(field);
    if (next == 0) {
        free(over);
        return NULL;
    }
    return over;
}

/* Whether fields over the columns of numbers are units, and one at least is a known one. */
static bool are_units(const text_field_t *field, const layout_t *layout, size_t least) {
    bool all = true, known = false;
    for (size_t j = 0; j < least; j++) {
        if (layout->number[j]) {
            all = all && text_is_unit(field[j].text);
            known = known || field[j].text[0] != '\0';
        }
    }
    return all && known;
}

/* The line of names above the data, and that of units below it; below that may be one of remarks (Origin). Both are to
 * be freed, and NULL where there is none. */
static void find_heads(const text_source_t *source, const layout_t *layout, size_t least, text_field_t **names,
                       text_field_t **units) {
    text_field_t *fields[HEADS];
    size_t count[HEADS] = {0}, found = 0, of_units = HEADS;
    for (size_t i = layout->begin; i > 0 && found < HEADS; i--) {
        if (!is_blank(source->line[i - 1])) {
            fields[found] = allocate(MOST_COLUMNS, sizeof *fields[found]);
            count[found] = split_names(source->line[i - 1], layout->dialect.separator, least, fields[found]);
            if (of_units == HEADS && count[found] > 0 && are_units(fields[found], layout, least)) {
                of_units = found;
            }
            found++;
        }
    }
    const size_t of_names = of_units < HEADS ? of_units + 1 : 0;
    *units = *names = NULL;
    for (size_t i = 0; i < found; i++) {
        if (i == of_units) {
            *units = fields[i];
        } else if (i == of_names && count[i] > 0) {
            *names = fields[i];
        } else {
            free(fields[i]);
        }
    }
}

/* R writes the numbers of rows in front, and no name over them: names that are one short belong to the columns behind.
 */
static text_field_t *names_behind_numbers(const text_source_t *source, const layout_t *layout, size_t least,
                                          const double *first) {
    text_field_t *field = allocate(MOST_COLUMNS + 1, sizeof *field);
    const size_t above = layout->begin;
    const bool counts = layout->number[0] && first[0] == 1.0 && first[1] == 2.0 && first[2] == 3.0;
    if (counts && above > 0 && least > 2 &&
        split_names(source->line[above - 1], layout->dialect.separator, least - 1, field + 1) == least - 1) {
        return field;
    }
    free(field);
    return NULL;
}

/* What a header line states about the columns goes before the line above the data. */
static void prefer(text_field_t **field, text_field_t *better) {
    if (better != NULL) {
        free(*field);
        *field = better;
    }
}

static void name_columns(table_t *table, const text_source_t *source, const layout_t *layout, double **value) {
    size_t least = 0, column = 0;
    text_field_t *names, *units;
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        least = layout->number[j] ? j + 1 : least;
    }
    find_heads(source, layout, least, &names, &units);
    if (names == NULL && table->rows > 2) {
        names = names_behind_numbers(source, layout, least, value[0]);
    }
    prefer(&names, stated(source, layout, least, text_is_name_key));
    prefer(&names, numbered(source, layout, "name"));
    prefer(&units, numbered(source, layout, "unit"));
    prefer(&units, numbered(source, layout, "dispunit"));
    text_field_t *over = units == NULL ? stated(source, layout, least, text_is_unit_key) : NULL;
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        if (layout->number[j]) {
            char name[TEXT_FIELD], unit[TEXT_FIELD], written[TEXT_FIELD];
            double number;
            const char *end;
            snprintf(name, sizeof name, "%s", names != NULL ? names[j].text : "");
            snprintf(unit, sizeof unit, "%s", units != NULL ? units[j].text : "");
            if (name[0] == '\0' || (decimal_read(name, layout->dialect.point, &number, &end) && *end == '\0')) {
                snprintf(name, sizeof name, "column %zu", j + 1);
            }
            snprintf(written, sizeof written, "%s", name);
            if (unit[0] == '\0') {
                unit_split(name, unit, "/_ ");
            }
            if (over != NULL && over[j].text[0] != '\0' && (unit[0] == '\0' || !text_is_unit(unit))) {
                snprintf(name, sizeof name, "%s", written);
                snprintf(unit, sizeof unit, "%s", over[j].text);
            }
            text_bare_unit(unit);
            table_add(table, name, unit, written, value[column++]);
            table->column[table->columns - 1].number = j + 1;
        }
    }
    free(over);
    free(names);
    free(units);
}

/* Fields of some lines of data: what of them is whole, and whether a column of numbers is lost to signs. */
static bool check_signs(const text_source_t *source, const layout_t *layout, const char *path, failure_t *failure) {
    const size_t rows = layout->end - layout->begin, step = 1 + rows / SAMPLE_LINES;
    text_signs_t signs = {.whole = true};
    size_t numbers[MOST_COLUMNS] = {0}, grouped[MOST_COLUMNS] = {0}, line_of[MOST_COLUMNS] = {0}, lines = 0;
    bool short_one[MOST_COLUMNS], three[MOST_COLUMNS];
    memset(short_one, 1, sizeof short_one);
    memset(three, 1, sizeof three);
    for (size_t i = layout->begin; i < layout->end; i += step) {
        const char *at = source->line[i];
        for (size_t j = 0; at != NULL && j < MOST_COLUMNS; j++) {
            const char *field;
            size_t length;
            double number;
            at = next_field(at, layout->dialect.separator, &field, &length);
            const bool is_number = field_kind(field, length, layout->dialect.point, &number) == FIELD_NUMBER;
            const size_t sign = length > 0 && (*field == '-' || *field == '+') ? 1 : 0;
            const size_t digits =
                strspn(field + sign, "0123456789") < length - sign ? strspn(field + sign, "0123456789") : length - sign;
            numbers[j] += is_number;
            if (text_is_grouped(field, length) && !is_number) {
                grouped[j]++;
                line_of[j] = i;
            }
            signs.whole = signs.whole && (!layout->number[j] || digits + sign == length);
            short_one[j] = short_one[j] && digits + sign == length && digits <= 3;
            three[j] = three[j] && sign == 0 && digits == 3;
            signs.fields = layout->number[j] && j >= signs.fields ? j + 1 : signs.fields;
        }
        lines++;
    }
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        if (!layout->number[j] && grouped[j] > 0 && (numbers[j] + grouped[j]) * 10 >= lines * 9) {
            return fail(
                failure,
                "%s: line %zu: column %zu has signs between thousands: '%.60s': export the numbers without them", path,
                line_of[j] + 1, j + 1, source->line[line_of[j]]);
        }
        signs.thousands = signs.thousands || (j > 0 && layout->number[j] && short_one[j - 1] && three[j]);
    }
    size_t above = layout->begin;
    while (above > 0 && is_blank(source->line[above - 1])) {
        above--;
    }
    if (above > 0) {
        field_kind_t kind[MOST_COLUMNS];
        const size_t fields = line_shape(source->line[above - 1], layout->dialect, kind);
        while (signs.names < fields && kind[signs.names] == FIELD_TEXT) {
            signs.names++;
        }
        signs.names = signs.names == fields ? fields : 0;
    }
    const char *problem = text_signs_problem(&signs);
    return problem == NULL || fail(failure, "%s: line %zu has %zu names, and line %zu has %zu fields, %s", path, above,
                                   signs.names, layout->begin + 1, signs.fields, problem);
}

bool table_read_text(table_t *table, const char *path, failure_t *failure) {
    text_source_t source;
    layout_t *layout = allocate(1, sizeof *layout);
    double **value = NULL;
    bool good = text_source_read(&source, path, failure);
    table_open(table, path, "text");
    if (good && source.lines == 0) {
        good = fail(failure, "%s: empty file", path);
    }
    good = good && find_layout(&source, path, layout, failure) && check_signs(&source, layout, path, failure);
    if (good) {
        value = allocate(layout->columns, sizeof *value);
        for (size_t i = 0; i < layout->columns; i++) {
            value[i] = allocate(layout->end - layout->begin, sizeof **value);
        }
        describe(table, &source, layout);
        table->first_line = (unsigned long)layout->begin + 1;
        good = read_rows(table, &source, layout, value, failure);
        if (good) {
            name_columns(table, &source, layout, value);
            text_find_role_units(table, (const char *const *)source.line, layout->begin);
            text_find_interval(table, (const char *const *)source.line,
                               layout->begin + SURE_LINES < source.lines ? layout->begin + SURE_LINES : source.lines,
                               layout->dialect.separator, layout->dialect.point);
            if (layout->end < source.lines && !is_blank(source.line[layout->end])) {
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
