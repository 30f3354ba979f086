/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/column_choice.h"
#include "recording/column_pattern.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum {
    MOST_LISTED = 10, /* columns that one line names */
    LIST_ROOM = 240,  /* characters beyond which no more are named */
    SHOWN = 30,       /* characters of each name */
    USABLE = 100,     /* its unit is that of the role, or none is stated */
    /* What says that a column is the drive or the displacement, from the surest on. Equal ones are not told apart. */
    NAMED_DRIVE = 40,
    WEAK_DRIVE = 35,
    NAMED_VOLTAGE = 20,
    ANY_VOLTAGE = 10,
    NAMED_POSITION = 20,
    UNIT_OF_LENGTH = 15,
    WEAK_POSITION = 10
};

#define LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"

typedef struct {
    column_choice_t *choice;
    const table_t *table;
    const import_options_t *options;
    import_account_t *problems;
    bool missing; /* a column was not found */
} chooser_t;

/* Columns that are equally good. */
typedef struct {
    size_t count;
    int *column;
    int strength;
} candidates_t;

const char *role_name(int role) {
    return role == ROLE_TIME ? "time" : column_name((column_t)role);
}

static const char *said_for(const chooser_t *c, int role) {
    return role == ROLE_TIME ? c->options->time : c->options->column[role];
}

bool column_is_used(const column_choice_t *choice, int column) {
    for (int role = 0; role < ROLES; role++) {
        if (choice->column[role] == column) {
            return true;
        }
    }
    return false;
}

static void take(chooser_t *c, int role, int column, const char *why) {
    c->choice->column[role] = column;
    c->choice->why[role] = why;
}

/* ---- what the values say */

static bool rises(const double *value, size_t rows) {
    for (size_t k = 1; k < rows; k++) {
        if (!(value[k] > value[k - 1])) {
            return false;
        }
    }
    return true;
}

static bool steps_by(const double *value, size_t rows, double step) {
    for (size_t k = 1; k < rows; k++) {
        if (value[k] - value[k - 1] != step) {
            return false;
        }
    }
    return true;
}

/* Further columns with the same times: LabVIEW writes one for each signal. */
static bool repeats_time(const column_choice_t *choice, const table_t *table, int column) {
    const int time = choice->column[ROLE_TIME];
    return time != NO_COLUMN && time != column &&
           memcmp(table->column[time].value, table->column[column].value, table->rows * sizeof(double)) == 0;
}

/* Why no values of a column can be a signal; NULL: they can. */
static const char *no_signal(const column_choice_t *choice, const table_t *table, int column) {
    const double *value = table->column[column].value;
    return repeats_time(choice, table, column) ? "the same times"
           : steps_by(value, table->rows, 0.0) ? "never changes"
           : steps_by(value, table->rows, 1.0) ? "counts"
                                               : NULL;
}

/* ---- lists of columns, for messages */

/* Of the name of a path its end: the last part says most. */
static const char *shown_part(const char *name) {
    const size_t length = strlen(name);
    const char *end = name + (strchr(name, '/') != NULL && length > SHOWN ? length - SHOWN : 0);
    while (((unsigned char)*end & 0xC0) == 0x80) { /* not from within a letter of UTF-8 */
        end++;
    }
    return end;
}

static void list_column(const column_choice_t *choice, const table_t *table, int i, char *text, size_t room) {
    const table_column_t *column = &table->column[i];
    const char *what = choice->meaning[i].meaning == MEANING_UNKNOWN ? no_signal(choice, table, i) : NULL;
    const size_t used = strlen(text);
    const char *name = shown_part(column->name);
    (void)snprintf(text + used, room - used, "%s%zu '%s%.*s'%s%.12s (%s)", used > 0 ? ", " : "", column->number,
                   name > column->name ? ".." : "", SHOWN, name, column->unit[0] != '\0' ? " in " : "", column->unit,
                   what != NULL ? what : meaning_text(choice->meaning[i].meaning));
}

static void list_more(size_t listed, size_t all, char *text, size_t room) {
    const size_t used = strlen(text);
    if (all > listed) {
        (void)snprintf(text + used, room - used, " and %zu more", all - listed);
    }
}

void columns_not_used(const column_choice_t *choice, const table_t *table, char *text, size_t room) {
    size_t listed = 0, all = 0;
    text[0] = '\0';
    for (size_t i = 0; i < table->columns; i++) {
        if (!column_is_used(choice, (int)i)) {
            if (all++ < MOST_LISTED) {
                list_column(choice, table, (int)i, text, room);
                listed++;
            }
        }
    }
    list_more(listed, all, text, room);
}

/* ---- what the caller said */

/* The only column whose name's last part it is, or NO_COLUMN. */
static int find_last_part(const table_t *table, const char *said) {
    int found = NO_COLUMN;
    for (size_t i = 0; i < table->columns; i++) {
        if (strcasecmp(column_last_part(table->column[i].name), said) == 0) {
            if (found != NO_COLUMN) {
                return NO_COLUMN;
            }
            found = (int)i;
        }
    }
    return found;
}

/* By name, with or without its unit, as it is written before any other case; by the name's last part; by number. */
static int find_said(chooser_t *c, const char *said, int role) {
    const table_t *table = c->table;
    char *end;
    const unsigned long number = strtoul(said, &end, 10);
    for (int any_case = 0; any_case < 2; any_case++) {
        int (*const compare)(const char *, const char *) = any_case != 0 ? strcasecmp : strcmp;
        for (size_t i = 0; i < table->columns; i++) {
            if (compare(table->column[i].name, said) == 0 || compare(table->column[i].written, said) == 0) {
                return (int)i;
            }
        }
    }
    const int by_last_part = find_last_part(table, said);
    if (by_last_part != NO_COLUMN) {
        return by_last_part;
    }
    for (size_t i = 0; *end == '\0' && i < table->columns; i++) {
        if (table->column[i].number == number) {
            return (int)i;
        }
    }
    import_account_add(c->problems, "no column '%s' for %s: there are %zu columns, from '%s' to '%s'", said,
                       role_name(role), table->columns, table->column[0].name, table->column[table->columns - 1].name);
    return NO_COLUMN;
}

/* No column is two things at once. */
static void take_said(chooser_t *c, int role, const char *said) {
    const int column = find_said(c, said, role);
    for (int other = 0; column != NO_COLUMN && other < role; other++) {
        if (c->choice->column[other] == column) {
            import_account_add(c->problems, "column %zu '%s' cannot be both %s and %s: say another for one of them",
                               c->table->column[column].number, c->table->column[column].name, role_name(other),
                               role_name(role));
        }
    }
    take(c, role, column, "as asked for");
}

/* ---- what names and units say */

static const char *how(const column_meaning_t *meaning) {
    return meaning->said == SAID_BY_UNIT ? "by its unit" : "by its name";
}

static void find_time(chooser_t *c) {
    const table_t *table = c->table;
    int best = NO_COLUMN, counter = NO_COLUMN, best_strength = 0;
    for (size_t i = 0; i < table->columns; i++) {
        const column_meaning_t *m = &c->choice->meaning[i];
        if (column_is_used(c->choice, (int)i) || (m->meaning != MEANING_TIME && m->meaning != MEANING_COUNTER)) {
            continue;
        }
        const bool rising = rises(table->column[i].value, table->rows);
        const int strength = 1 + (m->quantity == QUANTITY_TIME ? 1 : 0) + (rising ? 2 : 0);
        if (m->meaning == MEANING_TIME && strength > best_strength) {
            best = (int)i;
            best_strength = strength;
        } else if (m->meaning == MEANING_COUNTER && rising && counter == NO_COLUMN) {
            counter = (int)i;
        }
    }
    const column_meaning_t *const first = &c->choice->meaning[0];
    if (best != NO_COLUMN) {
        take(c, ROLE_TIME, best, how(&c->choice->meaning[best]));
    } else if (counter != NO_COLUMN) {
        take(c, ROLE_TIME, counter, "it counts");
    } else if (!column_is_used(c->choice, 0) && rises(table->column[0].value, table->rows) &&
               (first->meaning == MEANING_UNKNOWN || /* "X" of an oscilloscope */
                (first->said == SAID_WEAKLY && first->quantity == QUANTITY_UNKNOWN))) {
        const bool counts = steps_by(table->column[0].value, table->rows, 1.0); /* pandas' index, "X" of a scope */
        c->choice->meaning[0].meaning = counts ? MEANING_COUNTER : first->meaning;
        take(c, ROLE_TIME, 0, counts ? "it counts" : "the first column, which rises steadily");
    }
}

static bool is_usable(const chooser_t *c, int role, int column) {
    static const quantity_t wanted[COLUMN_COUNT] = {
        [COLUMN_DRIVE] = QUANTITY_VOLTAGE,    [COLUMN_DISPLACEMENT] = QUANTITY_LENGTH,
        [COLUMN_REFERENCE] = QUANTITY_LENGTH, [COLUMN_VOLTAGE] = QUANTITY_VOLTAGE,
        [COLUMN_CURRENT] = QUANTITY_CURRENT,  [COLUMN_TEMPERATURE] = QUANTITY_TEMPERATURE};
    const quantity_t quantity = c->choice->meaning[column].quantity;
    return quantity == wanted[role] || (quantity == QUANTITY_UNKNOWN && c->table->column[column].unit[0] == '\0');
}

/* How surely a column is that; 0: not at all. */
static int strength_of(const chooser_t *c, int role, int column) {
    const column_meaning_t *m = &c->choice->meaning[column];
    int strength = 0;
    switch (role) {
    case COLUMN_DRIVE:
        strength = m->meaning == MEANING_DRIVE              ? (m->said == SAID_BY_NAME ? NAMED_DRIVE : WEAK_DRIVE)
                   : m->meaning == MEANING_VOLTAGE          ? (m->said == SAID_BY_UNIT ? ANY_VOLTAGE : NAMED_VOLTAGE)
                   : m->meaning == MEANING_MEASURED_VOLTAGE ? ANY_VOLTAGE
                                                            : 0;
        break;
    case COLUMN_DISPLACEMENT:
        strength = m->meaning != MEANING_DISPLACEMENT ? 0
                   : m->said == SAID_BY_NAME          ? NAMED_POSITION
                   : m->said == SAID_BY_UNIT          ? UNIT_OF_LENGTH
                                                      : WEAK_POSITION;
        break;
    case COLUMN_VOLTAGE: {
        const int drive = c->choice->column[COLUMN_DRIVE];
        const bool other = drive != NO_COLUMN && c->choice->meaning[drive].meaning == MEANING_DRIVE;
        strength = m->meaning == MEANING_MEASURED_VOLTAGE                              ? 2
                   : m->meaning == MEANING_VOLTAGE && m->said != SAID_BY_UNIT && other ? 1
                                                                                       : 0;
        break;
    }
    default:
        strength = m->meaning == (role == COLUMN_REFERENCE ? MEANING_REFERENCE
                                  : role == COLUMN_CURRENT ? MEANING_CURRENT
                                                           : MEANING_TEMPERATURE)
                       ? 1
                       : 0;
        break;
    }
    return strength > 0 && is_usable(c, role, column) ? strength + USABLE : strength;
}

/* "Position" is meant, where "Position filtered" stands beside it; not beside "Position 2". */
static void keep_shortest(const chooser_t *c, candidates_t *found) {
    int shortest = found->column[0];
    for (size_t i = 1; i < found->count; i++) {
        const char *name = c->table->column[found->column[i]].name;
        shortest = strlen(name) < strlen(c->table->column[shortest].name) ? found->column[i] : shortest;
    }
    const char *name = c->table->column[shortest].name;
    const size_t length = strlen(name);
    for (size_t i = 0; i < found->count; i++) {
        const char *other = c->table->column[found->column[i]].name;
        const char *more = other + (strncasecmp(other, name, length) == 0 ? length : 0);
        if (found->column[i] != shortest && (more == other || more[strcspn(more, LETTERS)] == '\0')) {
            return;
        }
    }
    found->column[0] = shortest;
    found->count = 1;
}

/* Of several those that change, if any does, and of the same numbers the first: a parked axis is not meant. */
static void keep_signals(const chooser_t *c, candidates_t *found) {
    const size_t rows = c->table->rows;
    size_t kept = 0;
    for (size_t i = 0; found->count > 1 && i < found->count; i++) {
        const double *value = c->table->column[found->column[i]].value;
        bool is_new = !steps_by(value, rows, 0.0);
        for (size_t j = 0; is_new && j < kept; j++) {
            is_new = memcmp(c->table->column[found->column[j]].value, value, rows * sizeof *value) != 0;
        }
        if (is_new) {
            found->column[kept++] = found->column[i];
        }
    }
    found->count = kept > 0 ? kept : found->count;
}

/* The surest columns of a role; the one that the caller said, if so. To be freed. */
static candidates_t find_candidates(const chooser_t *c, int role) {
    candidates_t found = {.column = allocate(c->table->columns, sizeof(int))};
    if (said_for(c, role) != NULL) {
        found.count = c->choice->column[role] != NO_COLUMN ? 1 : 0;
        found.column[0] = c->choice->column[role];
        return found;
    }
    for (size_t i = 0; i < c->table->columns; i++) {
        const int strength = column_is_used(c->choice, (int)i) ? 0 : strength_of(c, role, (int)i);
        if (strength == 0 || strength < found.strength || repeats_time(c->choice, c->table, (int)i)) {
            continue;
        }
        found.count = strength > found.strength ? 0 : found.count;
        found.strength = strength;
        found.column[found.count++] = (int)i;
    }
    if (found.count > 1) {
        keep_shortest(c, &found);
    }
    return found;
}

/* A role that may stay empty: where one column is clear, and its unit is known. */
static void find_optional(chooser_t *c, int role) {
    if (said_for(c, role) != NULL) {
        return;
    }
    const candidates_t found = find_candidates(c, role);
    if (found.count == 1 && (found.strength >= USABLE || c->options->scale[role] != 0.0)) {
        take(c, role, found.column[0], how(&c->choice->meaning[found.column[0]]));
    }
    free(found.column);
}

/* ---- what is left, and what is not clear */

/* Columns that may be taken by place: nothing says what they are, or they are some voltage. */
static candidates_t find_pool(const chooser_t *c, bool voltages) {
    candidates_t pool = {.column = allocate(c->table->columns, sizeof(int))};
    for (size_t i = 0; i < c->table->columns; i++) {
        const meaning_t meaning = c->choice->meaning[i].meaning;
        if (!column_is_used(c->choice, (int)i) &&
            (meaning == MEANING_UNKNOWN || (voltages && meaning == MEANING_VOLTAGE)) &&
            no_signal(c->choice, c->table, (int)i) == NULL) {
            pool.column[pool.count++] = (int)i;
        }
    }
    return pool;
}

/* Names columns until there is no more room; column: NULL for the first ones of the table. */
static void list_columns(const chooser_t *c, const int *column, size_t count, char *text, size_t size) {
    size_t listed = 0;
    for (; listed < count && listed < MOST_LISTED && strlen(text) < LIST_ROOM; listed++) {
        list_column(c->choice, c->table, column != NULL ? column[listed] : (int)listed, text, size);
    }
    list_more(listed, count, text, size);
}

static void complain_unclear(chooser_t *c, int role, const candidates_t *found) {
    char text[500] = "";
    list_columns(c, found->column, found->count, text, sizeof text);
    import_account_add(c->problems, "%zu columns could be the %s: %s: say which (hyst import --%s NAME)", found->count,
                       role_name(role), text, role_name(role));
}

static void complain_missing(chooser_t *c, int role) {
    import_account_add(c->problems, "no column is left for %s: the file has %zu", role_name(role), c->table->columns);
    c->missing = true;
}

/* Of a binary file: the arrays that are no columns, numbers alone apart. What is missing may be one of them. Returns
 * how many there are. */
static size_t list_left_out(const table_t *table, char *text, size_t room) {
    size_t used = 0, count = 0;
    for (size_t i = 0; table->first_line == 0 && i < table->notes; i++) {
        if (strstr(table->note[i], TABLE_ONE_NUMBER) == NULL) {
            used += used < LIST_ROOM
                        ? (size_t)snprintf(text + used, room - used, "%s%.150s", count > 0 ? ", " : "", table->note[i])
                        : 0;
            count++;
        }
    }
    return count;
}

/* What there is instead of what is missing. */
static void list_all(chooser_t *c) {
    char text[600] = "", others[500] = "";
    list_columns(c, NULL, c->table->columns, text, sizeof text);
    const size_t signals = c->table->columns - (c->choice->column[ROLE_TIME] != NO_COLUMN ? 1 : 0);
    if (signals < 2 && list_left_out(c->table, others, sizeof others) > 0) {
        import_account_add(c->problems, "the columns are %s: left out are others: %s", text, others);
        return;
    }
    import_account_add(c->problems, "the columns are %s: %s", text,
                       signals < 2
                           ? "drive and displacement have to stand in one file: put the columns of both side by side"
                           : "say which (hyst import --drive NAME --displacement NAME)");
    if (c->table->partial != NULL) {
        import_account_add(c->problems, "%s: put what belongs together in a file each", c->table->partial);
    }
}

/* Where all candidates belong to actuators that are numbered alike, the first is meant. */
static bool are_siblings(const chooser_t *c, const candidates_t *drive, const candidates_t *position) {
    char pattern[2][COLUMN_PATTERN];
    const size_t most = drive->count > position->count ? drive->count : position->count;
    return drive->count > 0 && position->count > 0 && most > 1 && said_for(c, COLUMN_DRIVE) == NULL &&
           said_for(c, COLUMN_DISPLACEMENT) == NULL &&
           column_pattern_siblings(c->table, c->table->column[drive->column[0]].name,
                                   c->table->column[position->column[0]].name, pattern) == most;
}

static void take_candidate(chooser_t *c, int role, const candidates_t *found) {
    if (said_for(c, role) == NULL) {
        take(c, role, found->column[0], how(&c->choice->meaning[found->column[0]]));
    }
}

/* One of both is known, or none is: the rest by place, or a problem. */
static void find_rest(chooser_t *c, int missing, bool voltages) {
    const candidates_t pool = find_pool(c, voltages);
    if (pool.count == 1) {
        take(c, missing, pool.column[0], "the only column left");
    } else if (pool.count == 0) {
        complain_missing(c, missing);
    } else {
        complain_unclear(c, missing, &pool);
    }
    free(pool.column);
}

/* Whether two names are the same but for their numbers. */
static bool are_numbered(const char *a, const char *b) {
    static const char digits[] = "0123456789";
    a += strspn(a, digits);
    b += strspn(b, digits);
    while (*a == *b && *a != '\0') {
        a += 1 + strspn(a + 1, digits);
        b += 1 + strspn(b + 1, digits);
    }
    return *a == *b;
}

/* Whether the names of two columns say something that is not known here: it may contradict their places. */
static bool are_strange(const chooser_t *c, const int *column) {
    return (c->choice->meaning[column[0]].strange || c->choice->meaning[column[1]].strange) &&
           !are_numbered(c->table->column[column[0]].name, c->table->column[column[1]].name);
}

static void find_both_by_place(chooser_t *c) {
    const candidates_t pool = find_pool(c, true);
    if (pool.count == 2 && !are_strange(c, pool.column)) {
        take(c, COLUMN_DRIVE, pool.column[0], "by its place");
        take(c, COLUMN_DISPLACEMENT, pool.column[1], "by its place");
    } else if (pool.count >= 2) {
        complain_unclear(c, COLUMN_DRIVE, &pool);
        import_account_add(c->problems, "and so could the displacement (--displacement NAME)");
    } else {
        if (pool.count == 1) {
            take(c, COLUMN_DRIVE, pool.column[0], "the only column left");
        } else {
            complain_missing(c, COLUMN_DRIVE);
        }
        complain_missing(c, COLUMN_DISPLACEMENT);
    }
    free(pool.column);
}

/* What tells one input from another: digits, or one letter. */
static bool is_number_of_input(const char *text) {
    const size_t length = strlen(text);
    return strspn(text, "0123456789") == length || (length == 1 && strspn(text, LETTERS) == 1);
}

/* Inputs of an instrument, "IN1" and "IN2", "Input A" and "Input B" in volts: what it measures, not what it commands.
 */
static bool are_inputs(const chooser_t *c, const candidates_t *found) {
    if (found->count != 2) {
        return false;
    }
    const table_column_t *a = &c->table->column[found->column[0]], *b = &c->table->column[found->column[1]];
    size_t same = 0;
    double scale;
    while (a->name[same] != '\0' && a->name[same] == b->name[same]) {
        same++;
    }
    return same > 0 && is_number_of_input(a->name + same) && is_number_of_input(b->name + same) &&
           unit_of(a->unit, &scale) == QUANTITY_VOLTAGE && unit_of(b->unit, &scale) == QUANTITY_VOLTAGE;
}

static void find_drive_and_displacement(chooser_t *c) {
    candidates_t drive = find_candidates(c, COLUMN_DRIVE), position = find_candidates(c, COLUMN_DISPLACEMENT);
    const bool drive_open = said_for(c, COLUMN_DRIVE) == NULL, position_open = said_for(c, COLUMN_DISPLACEMENT) == NULL;
    const bool siblings = are_siblings(c, &drive, &position);
    if (!siblings) {
        keep_signals(c, &drive);
        keep_signals(c, &position);
    }
    const bool some_voltage = drive_open && drive.count > 1 && drive.strength % USABLE < WEAK_DRIVE;
    if (siblings || (drive.count == 1 && position.count == 1)) {
        take_candidate(c, COLUMN_DRIVE, &drive);
        take_candidate(c, COLUMN_DISPLACEMENT, &position);
    } else if (position.count == 0 && position_open && drive_open && (drive.count == 0 || some_voltage)) {
        find_both_by_place(c);
    } else if (position.count == 0 && position_open && drive_open && are_inputs(c, &drive)) {
        take(c, COLUMN_DRIVE, drive.column[0], "by its place");
        take(c, COLUMN_DISPLACEMENT, drive.column[1], "by its place");
    } else {
        if (drive.count == 1) {
            take_candidate(c, COLUMN_DRIVE, &drive);
        }
        if (position.count == 1) {
            take_candidate(c, COLUMN_DISPLACEMENT, &position);
        }
        if (drive.count > 1) {
            complain_unclear(c, COLUMN_DRIVE, &drive);
        }
        if (position.count > 1) {
            complain_unclear(c, COLUMN_DISPLACEMENT, &position);
        }
        if (drive.count == 0 && drive_open) {
            find_rest(c, COLUMN_DRIVE, false);
        }
        if (position.count == 0 && position_open) {
            find_rest(c, COLUMN_DISPLACEMENT, drive.count <= 1);
        }
    }
    free(drive.column);
    free(position.column);
}

void columns_choose(column_choice_t *choice, const table_t *table, const import_options_t *options,
                    import_account_t *problems) {
    chooser_t c = {.choice = choice, .table = table, .options = options, .problems = problems};
    choice->meaning = allocate(table->columns, sizeof *choice->meaning);
    for (size_t i = 0; i < table->columns; i++) {
        choice->meaning[i] = column_meaning(&table->column[i]);
    }
    for (int role = 0; role < ROLES; role++) {
        take(&c, role, NO_COLUMN, "");
    }
    for (int role = 0; role < ROLES; role++) {
        const char *said = said_for(&c, role);
        if (said != NULL && !(role == ROLE_TIME && strcmp(said, "none") == 0)) {
            take_said(&c, role, said);
        }
    }
    if (options->time == NULL) {
        find_time(&c);
    }
    find_drive_and_displacement(&c);
    for (int role = COLUMN_REFERENCE; role < COLUMN_COUNT; role++) {
        find_optional(&c, role);
    }
    if (c.missing) {
        list_all(&c);
    }
}

void column_choice_free(column_choice_t *choice) {
    free(choice->meaning);
    choice->meaning = NULL;
}
