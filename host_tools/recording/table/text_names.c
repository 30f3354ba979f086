/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/text_names.h"
#include "recording/table/column_words.h"
#include "recording/table/decimal.h"
#include "recording/table/text_header.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    HEADS = 3, /* lines above the data in which names and units are looked for */
    FACTS = 30 /* rows of data beside which facts are looked for */
};

/* How a line of a header may be split, beside the separators of the data. */
enum { WIDE_GAPS = 1, WITH_UNITS, UNTIL_UNITS };

static bool ends_a_unit(const char *word, size_t length) {
    return length > 0 && strchr(")]", word[length - 1]) != NULL;
}

/* Whether the word at `next` belongs to the name before it, [name, end). */
static bool goes_on(char way, const char *name, const char *end, const char *next) {
    switch (way) {
    case WIDE_GAPS:
        return next - end == 1 && *end == ' ';
    case WITH_UNITS: /* a unit alone is no name */
        return strchr("([", *next) != NULL && strchr("([", *name) == NULL && !ends_a_unit(name, (size_t)(end - name));
    default:
        return !ends_a_unit(name, (size_t)(end - name));
    }
}

/* The next name of a line, and what comes behind it: between gaps of two blanks and more; a word, and the unit in
 * brackets behind it; or words up to such a unit. */
static const char *next_name(const char *line, char way, const char **field, size_t *length) {
    if (way > UNTIL_UNITS) {
        return text_next_field(line, way, field, length);
    }
    const char *next = text_next_field(line, ' ', field, length);
    while (next != NULL && goes_on(way, *field, *field + *length, next)) {
        const char *more;
        size_t size;
        next = text_next_field(next, ' ', &more, &size);
        *length = (size_t)(more - *field) + size;
    }
    return next;
}

/* Two quotes, inside of quotes, stand for one. */
static void join_quotes(char *text) {
    char *to = text;
    for (const char *from = text; *from != '\0'; from++) {
        from += from[0] == '"' && from[1] == '"';
        *to++ = *from;
    }
    *to = '\0';
}

static size_t split_one_way(const char *line, char way, text_field_t field[MOST_COLUMNS]) {
    const char *at = text_behind_list_key(line + strspn(line, "#%/! "));
    size_t count = 0;
    while (at != NULL && count < MOST_COLUMNS) {
        const char *text;
        size_t length;
        at = next_name(at, way, &text, &length);
        snprintf(field[count].text, sizeof field[count].text, "%.*s", (int)length, text);
        join_quotes(field[count].text);
        count++;
    }
    return count;
}

/* Splits a line of the header like the data, where it may have more fields than these; or in whatever way makes just as
 * many. Blanks leave no field empty: of more words than columns it is not known which belong together. 0: no way. */
static size_t split_names(const char *line, const layout_t *layout, size_t least, text_field_t field[MOST_COLUMNS]) {
    static const char others[] = {'\t', ';', ',', WIDE_GAPS, WITH_UNITS, UNTIL_UNITS, ' '};
    if (layout->dialect.separator != ' ') {
        const size_t count = split_one_way(line, layout->dialect.separator, field);
        if (count >= least) {
            return count;
        }
    }
    for (size_t i = 0; i < sizeof others; i++) {
        const size_t count = split_one_way(line, others[i], field);
        if (count == least || (count > least && count == layout->fields)) {
            return count;
        }
    }
    return 0;
}

/* The fields of a keyed line that are not empty, over the columns in their order: where they reach beyond the last
 * column, empty ones stand for something else (Tektronix). false: there are not as many, less perhaps the first. */
static bool close_gaps(text_field_t *field, size_t count, size_t columns) {
    size_t filled = 0, next;
    for (size_t j = 1; j < count; j++) {
        filled += field[j].text[0] != '\0';
    }
    if (filled != columns && filled + 1 != columns) {
        return false;
    }
    next = columns - filled;
    text_field_t *const old = allocate(count, sizeof *old);
    memcpy(old, field, count * sizeof *old);
    field[0].text[0] = '\0';
    for (size_t j = 1; j < count; j++) {
        if (old[j].text[0] != '\0') {
            field[next++] = old[j];
        }
    }
    free(old);
    return true;
}

/* The fields of the last header line that begins with such a key, over their columns; NULL: there is none. To be
 * freed. Where the key does not stand over a column itself, the first field is that behind it. */
static text_field_t *stated(const text_source_t *source, const layout_t *layout, size_t least,
                            bool (*is_key)(const char *field)) {
    text_field_t *field = allocate(MOST_COLUMNS + 1, sizeof *field);
    for (size_t i = layout->begin; i > 0; i--) {
        size_t count = split_names(source->line[i - 1], layout, least, field), empty = 0;
        bool prose = false;
        if (count < least || !is_key(field[0].text)) {
            continue;
        }
        while (count > 0 && field[count - 1].text[0] == '\0') {
            count--;
        }
        for (size_t j = 1; j < count; j++) {
            if (is_key(field[j].text)) { /* one for each signal (TwinCAT) */
                field[j].text[0] = '\0';
            }
            empty += field[j].text[0] == '\0';
            prose = prose || strchr(field[j].text, '=') != NULL; /* "drive=mV" */
        }
        if (prose) {
            continue;
        }
        if (count > least && empty > 0 && least == layout->columns) {
            count = close_gaps(field, count, least) ? count : 0;
        } else if (count > 1 && layout->number[0] && count == least + 1) {
            memmove(field, field + 1, (MOST_COLUMNS - 1) * sizeof *field);
        } else {
            field[0].text[0] = '\0';
        }
        if (count > 1) { /* not a key alone */
            return field;
        }
    }
    free(field);
    return NULL;
}

/* Names and units by number, in the order of the columns of numbers ("# NAME0 = Target Position"): each over its
 * column. NULL: not one for each. To be freed. */
static text_field_t *numbered(const text_source_t *source, const layout_t *layout, const char *key) {
    text_field_t *field = allocate(MOST_COLUMNS, sizeof *field), *over = allocate(MOST_COLUMNS, sizeof *over);
    const size_t count = text_numbered((const char *const *)source->line, layout->begin, key, 0, field, MOST_COLUMNS);
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

/* "Sensor: capacitive", "Ch1: drive [mV]": a key with its value, and no line of names. A comma separates names, but
 * behind a number. */
static bool is_remark(const char *line) {
    const char *at = text_behind_list_key(line + strspn(line, "#%/! \t\""));
    const char *const colon = strchr(at, ':');
    if (colon == NULL || colon == at || strchr(colon + 1, ':') != NULL || strchr(" \t", colon[1]) == NULL) {
        return false;
    }
    const bool numbered = strchr("0123456789", colon[-1]) != NULL && at + strcspn(at, ",;|") > colon;
    return numbered || at[strcspn(at, ",;|\t")] == '\0';
}

/* The line above the data. */
static const char *line_above(const text_source_t *source, const layout_t *layout) {
    size_t above = layout->begin;
    while (above > 0 && text_is_blank(source->line[above - 1])) {
        above--;
    }
    return above > 0 ? source->line[above - 1] : "";
}

/* What remarks say of each channel, over its column: "# Ch1: drive [mV]", "% Column 2: position (nm)". Times in front
 * are no channel. NULL: not one for each. To be freed. */
static text_field_t *channels(const text_source_t *source, const layout_t *layout, double **value, size_t rows) {
    static const char *const keys[] = {"ch",     "chan",  "channel", "kanal", "voie",  "canal",
                                       "signal", "input", "column",  "col",   "spalte"};
    enum { OF_CHANNELS = 8 }; /* the others count times, too */
    text_field_t *over = NULL, *field = allocate(MOST_COLUMNS, sizeof *field);
    for (size_t i = 0; over == NULL && i < sizeof keys / sizeof keys[0]; i++) {
        const size_t first =
            text_numbered((const char *const *)source->line, layout->begin, keys[i], 1, field, MOST_COLUMNS) > 0 ? 1
                                                                                                                 : 0;
        const size_t count =
            text_numbered((const char *const *)source->line, layout->begin, keys[i], first, field, MOST_COLUMNS);
        bool timed = i < OF_CHANNELS && count + 1 == layout->columns;
        for (size_t k = 1; timed && k < rows; k++) {
            timed = value[0][k] > value[0][k - 1];
        }
        if (count < 2 || (count != layout->columns && !timed)) {
            continue;
        }
        over = allocate(MOST_COLUMNS, sizeof *over);
        for (size_t j = 0, next = 0; j < MOST_COLUMNS; j++) {
            if (layout->number[j] && timed) {
                timed = false;
            } else if (layout->number[j]) {
                over[j] = field[next++];
            }
        }
    }
    free(field);
    return over;
}

/* What stands in the first rows beside the numbers, behind its key: "Vertical Units,V,,-0.0193,0.728" (Tektronix TDS).
 * Over the column that it is of, the first one behind the times. NULL: no such key. To be freed. */
static text_field_t *beside(const text_source_t *source, const layout_t *layout, bool (*is_key)(const char *field)) {
    text_field_t *field = allocate(MOST_COLUMNS + 1, sizeof *field), *over = allocate(MOST_COLUMNS, sizeof *over);
    bool found = false;
    for (size_t i = layout->begin; i < layout->end && i < layout->begin + FACTS; i++) {
        const size_t count = split_one_way(source->line[i], layout->dialect.separator, field);
        for (size_t j = 0; j + 1 < count; j++) {
            if (layout->number[j] || layout->number[j + 1] || field[j + 1].text[0] == '\0' || !is_key(field[j].text)) {
                continue;
            }
            size_t of = j + 2;
            while (of + 1 < count && !layout->number[of]) {
                of++;
            }
            if (of + 1 < count && layout->number[of + 1]) {
                over[of + 1] = field[j + 1];
                found = true;
            }
        }
    }
    free(field);
    if (!found) {
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

/* A line of units behind its key, "unit,s,um,V": they are found where names are. */
static bool are_keyed_units(const text_field_t *field, size_t count, size_t least) {
    bool all = count >= least && least > 1 && text_is_unit_key(field[0].text);
    for (size_t j = 1; all && j < least; j++) {
        all = text_is_unit(field[j].text);
    }
    return all;
}

/* A field of nothing but signs, as lines are drawn under names. */
static bool is_drawn(const char *text) {
    return text[0] != '\0' && text[strspn(text, "-=_+:*. ")] == '\0' && strpbrk(text, "-=_") != NULL;
}

/* A number with a unit behind it, "1.000 kHz": a fact, and no name. */
static bool is_fact(const char *text) {
    const size_t length = strlen(text);
    for (const char *point = ".,"; *point != '\0'; point++) {
        double number;
        around_t around;
        if (text_field_kind(text, length, *point, &number, &around) == FIELD_NUMBER && around.unit_length > 0 &&
            around.label_length == 0) {
            return true;
        }
    }
    return false;
}

/* Whether a line of the header has neither names nor units over the columns: lines that are drawn, or facts. */
static bool is_no_head(const text_field_t *field, size_t count) {
    bool drawn = count > 0;
    if (count > 1 && text_is_scale_key(field[0].text)) {
        return true;
    }
    for (size_t j = 0; j < count; j++) {
        if (is_fact(field[j].text)) {
            return true;
        }
        drawn = drawn && (field[j].text[0] == '\0' || is_drawn(field[j].text));
    }
    return drawn;
}

/* The line of names above the data, and that of units below it; below that may be one of remarks (Origin). Both are to
 * be freed, and NULL where there is none. */
static void find_heads(const text_source_t *source, const layout_t *layout, size_t least, text_field_t **names,
                       text_field_t **units) {
    text_field_t *fields[HEADS];
    size_t count[HEADS] = {0}, found = 0, of_units = HEADS;
    for (size_t i = layout->begin; i > 0 && found < HEADS; i--) {
        if (!text_is_blank(source->line[i - 1]) && !is_remark(source->line[i - 1])) {
            fields[found] = allocate(MOST_COLUMNS, sizeof *fields[found]);
            count[found] = split_names(source->line[i - 1], layout, least, fields[found]);
            if (is_no_head(fields[found], count[found]) || are_keyed_units(fields[found], count[found], least)) {
                free(fields[found]);
                continue;
            }
            if (of_units == HEADS && count[found] > 0 && are_units(fields[found], layout, least)) {
                of_units = found;
            }
            found++;
        }
    }
    size_t of_names = of_units < HEADS ? of_units + 1 : 0;
    if (of_names >= found && of_units > 0 && of_units < found && count[of_units - 1] > 0) {
        of_names = of_units - 1; /* units stand above the names */
    }
    *units = *names = NULL;
    for (size_t i = 0; i < found; i++) {
        if (i == of_units) {
            *units = fields[i];
        } else if (i == of_names && count[i] > 0 && !text_is_label_key(fields[i][0].text)) {
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
        split_names(source->line[above - 1], layout, least - 1, field + 1) == least - 1) {
        return field;
    }
    free(field);
    return NULL;
}

/* Whether a field is a name of which a word or the unit is known. */
static bool is_known_name(const text_field_t *field) {
    char name[TEXT_FIELD], unit[TEXT_FIELD];
    double scale;
    snprintf(name, sizeof name, "%s", field->text);
    unit_split(name, unit, "/_ ,:");
    const unsigned words = column_words_read(name, name + strlen(name)).stands_for;
    return (words & ~(unsigned)(WORD_NOTHING | WORD_OTHER)) != 0 || unit_of(unit, &scale) != QUANTITY_UNKNOWN;
}

/* Columns up to the last one of numbers. */
static size_t least_columns(const layout_t *layout) {
    size_t least = 0;
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        least = layout->number[j] ? j + 1 : least;
    }
    return least;
}

bool text_has_names(const layout_t *layout, const char *line) {
    text_field_t *field = allocate(MOST_COLUMNS + 1, sizeof *field);
    const size_t least = least_columns(layout), count = split_names(line, layout, least, field);
    size_t known = 0;
    for (size_t j = 0; j < count && j < least; j++) {
        known += layout->number[j] && is_known_name(&field[j]);
    }
    free(field);
    return known >= 2;
}

/* What a header line states about the columns goes before the line above the data. */
static void prefer(text_field_t **field, text_field_t *better) {
    if (better != NULL) {
        free(*field);
        *field = better;
    }
}

/* Words stand over the columns, of which it is not known which belong together. */
static void tell_unnamed(table_t *table, const text_source_t *source, const layout_t *layout) {
    size_t above = layout->begin, words = 0;
    while (above > 0 && text_is_blank(source->line[above - 1])) {
        above--;
    }
    const char *line = line_above(source, layout);
    line += strspn(line, "#%/! ");
    for (const char *at = line; at != NULL && *at != '\0'; words++) {
        const char *word;
        size_t length;
        at = text_next_field(at, ' ', &word, &length);
    }
    if (words > 0) {
        char text[120];
        (void)snprintf(text, sizeof text, "line %zu has %zu words over %zu columns", above, words, layout->columns);
        table->unnamed = copy_text(text);
        table->unnamed_line = copy_text(line);
    }
}

/* The columns of words, which are no signals. */
static void tell_words(table_t *table, const layout_t *layout, const text_field_t *names, size_t least) {
    char text[300] = "";
    size_t used = 0, count = 0;
    for (size_t j = layout->labels ? 1 : 0; j < least && used < sizeof text; j++) {
        if (layout->word[j]) {
            const int printed =
                snprintf(text + used, sizeof text - used, "%s%zu%s%.30s%s", count > 0 ? ", " : "", j + 1,
                         names != NULL ? " '" : "", names != NULL ? names[j].text : "", names != NULL ? "'" : "");
            used += printed > 0 ? (size_t)printed : 0;
            count++;
        }
    }
    if (count > 0) {
        table_note(table, "words in column%s %s", count > 1 ? "s" : "", text);
    }
}

/* The unit of all signals, in a line of its key and nothing else: "#UNITS:V". The first column is none where it rises:
 * those are times or numbers. */
static void take_common_unit(table_t *table, const text_source_t *source, const layout_t *layout) {
    char unit[TEXT_FIELD];
    if (!text_find_common_unit((const char *const *)source->line, layout->begin, unit)) {
        return;
    }
    for (size_t i = 0; i < table->columns; i++) {
        table_column_t *column = &table->column[i];
        bool rises = i == 0;
        for (size_t k = 1; rises && k < table->rows; k++) {
            rises = column->value[k] > column->value[k - 1];
        }
        if (!rises && column->unit[0] == '\0') {
            free(column->unit);
            column->unit = copy_text(unit);
        }
    }
}

/* Which columns have a factor that is not 1 in a line of the header. It may have been applied, or not. */
static void mark_scaled(table_t *table, const text_source_t *source, const layout_t *layout) {
    text_field_t *const over = stated(source, layout, least_columns(layout), text_is_scale_key);
    for (size_t i = 0; over != NULL && i < table->columns; i++) {
        const char *text = over[table->column[i].number - 1].text, *end;
        double factor;
        table->column[i].scaled =
            decimal_read(text, layout->dialect.point, &factor, &end) && *end == '\0' && factor != 1.0;
    }
    free(over);
}

/* Columns that hold numbers in a part of the lines only: another table beside this one, of another length. */
static void tell_partial(table_t *table, const layout_t *layout, const text_field_t *names) {
    char text[200] = "";
    size_t used = 0, count = 0;
    for (size_t j = 0; j < layout->fields && used + 50 < sizeof text; j++) {
        if (layout->partial[j]) {
            used += (size_t)snprintf(text + used, sizeof text - used, "%s%zu '%.30s'", count > 0 ? ", " : "", j + 1,
                                     names != NULL ? names[j].text : "");
            count++;
        }
    }
    if (count > 0) {
        free(table->partial);
        table->partial = allocate(sizeof text + 60, 1);
        (void)snprintf(table->partial, sizeof text + 60, "column%s %s %s numbers in a part of the lines only",
                       count > 1 ? "s" : "", text, count > 1 ? "have" : "has");
        table_note(table, "%s", table->partial);
    }
}

void text_name_columns(table_t *table, const text_source_t *source, const layout_t *layout, double **value) {
    const size_t least = least_columns(layout);
    size_t column = 0;
    text_field_t *names, *units;
    find_heads(source, layout, least, &names, &units);
    if (names == NULL && table->rows > 2) {
        names = names_behind_numbers(source, layout, least, value[0]);
    }
    if (names == NULL || is_remark(line_above(source, layout))) {
        prefer(&names, channels(source, layout, value, table->rows));
    }
    prefer(&names, stated(source, layout, least, text_is_name_key));
    prefer(&names, numbered(source, layout, "name"));
    prefer(&units, numbered(source, layout, "unit"));
    prefer(&units, numbered(source, layout, "dispunit"));
    if (names == NULL && layout->columns < layout->fields) {
        names = beside(source, layout, text_is_source_key);
    }
    if (names == NULL && layout->dialect.separator == ' ') {
        tell_unnamed(table, source, layout);
    }
    tell_words(table, layout, names, layout->fields);
    tell_partial(table, layout, names);
    text_field_t *over = units == NULL ? stated(source, layout, least, text_is_unit_key) : NULL;
    if (units == NULL && over == NULL && layout->columns < layout->fields) {
        over = beside(source, layout, text_is_unit_key);
    }
    for (size_t j = 0; j < MOST_COLUMNS; j++) {
        if (layout->number[j]) {
            char name[TEXT_FIELD], unit[TEXT_FIELD], written[TEXT_FIELD];
            double number;
            const char *end;
            const around_text_t *around = &layout->around[j];
            snprintf(name, sizeof name, "%s",
                     around->label[0] != '\0' ? around->label
                     : names != NULL          ? names[j].text
                                              : "");
            snprintf(unit, sizeof unit, "%s", units != NULL ? units[j].text : "");
            if (name[0] == '\0' || (decimal_read(name, layout->dialect.point, &number, &end) && *end == '\0')) {
                snprintf(name, sizeof name, "column %zu", j + 1);
            }
            snprintf(written, sizeof written, "%s", name);
            if (unit[0] == '\0') {
                unit_split(name, unit, "/_ ,:");
            }
            if (name[0] == '\0') { /* "[ms]" */
                snprintf(name, sizeof name, "column %zu", j + 1);
            }
            if (over != NULL && over[j].text[0] != '\0' && (unit[0] == '\0' || !text_is_unit(unit))) {
                snprintf(name, sizeof name, "%s", written);
                snprintf(unit, sizeof unit, "%s", over[j].text);
            }
            text_bare_unit(unit);
            if (around->unit[0] != '\0') {
                snprintf(unit, sizeof unit, "%s", around->unit);
            }
            table_add(table, name, unit, written, value[column++]);
            table->column[table->columns - 1].number = j + 1;
            table->column[table->columns - 1].clock = around->clock;
        }
    }
    take_common_unit(table, source, layout);
    mark_scaled(table, source, layout);
    free(over);
    free(names);
    free(units);
}
