/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Reading a recording: lines, header, column names, numbers, time. Every message names the file and the line. */
#include "base/provenance.h"
#include "base/shown_name.h"
#include "recording/import.h"
#include "recording/recording.h"
#include "recording/recording_hdf5.h"
#include "recording/table/decimal.h"
#include "recording/table/units.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { BLOCK = 1 << 16, TIME_COLUMN = COLUMN_COUNT, FURTHER_COLUMN, MOST_FILE_COLUMNS = RECORDING_CSV_EXTRAS + 64 };

/* A column without a meaning here. */
typedef struct {
    char *name;
    double *value;
    bool numbers; /* some of its fields are numbers, or say that they are none ("nan"): else it is words, and dropped */
} further_t;

typedef struct {
    FILE *file;
    const char *path;
    unsigned long line; /* number of the line in `text` */
    char *text;         /* in `block` */
    size_t length;      /* of it */
    size_t at, filled;  /* of `block`: what was read from the file, and not yet taken */
    char block[BLOCK + 1];
    size_t columns;                 /* 0 until the line with the names was read */
    int meaning[MOST_FILE_COLUMNS]; /* a column_t, TIME_COLUMN or FURTHER_COLUMN */
    further_t further[MOST_FILE_COLUMNS];
    double scale[COLUMN_COUNT]; /* what the file's numbers are multiplied by, where it states another unit */
    bool has_unit[COLUMN_COUNT];
    double time[2]; /* of the previous and the present sample */
    size_t capacity;
    recording_t *recording;
    failure_t *failure;
} reader_t;

static bool complain(reader_t *reader, const char *what) {
    return fail(reader->failure, "%s:%lu: %s", reader->path, reader->line, what);
}

typedef enum { LINE_READ, LINE_END, LINE_BAD } line_t;

/* Only text, of lines that are looked at one by one; samples are numbers anyway. */
static bool check_text(reader_t *reader) {
    for (size_t i = 0; i < reader->length; i++) {
        const unsigned char c = (unsigned char)reader->text[i];
        if ((c < 0x20 && c != '\t' && c != '\r') || c == 0x7F) {
            return complain(reader, "binary data, not a recording");
        }
    }
    return true;
}

/* What is left of the block goes to its beginning, and the file fills the rest. */
static void refill(reader_t *reader) {
    const size_t left = reader->filled - reader->at;
    memmove(reader->block, reader->block + reader->at, left);
    reader->at = 0;
    reader->filled = left + fread(reader->block + left, 1, BLOCK - left, reader->file);
}

/* Next line, without its end (LF or CR LF). It stays in place until the next one. */
static line_t read_line(reader_t *reader) {
    char *end = memchr(reader->block + reader->at, '\n', reader->filled - reader->at);
    reader->line++;
    if (end == NULL) {
        refill(reader);
        end = memchr(reader->block, '\n', reader->filled);
    }
    if (ferror(reader->file)) {
        fail(reader->failure, "%s: %s", reader->path, strerror(errno));
        return LINE_BAD;
    }
    if (end == NULL && reader->filled == reader->at) {
        return LINE_END;
    }
    reader->text = reader->block + reader->at;
    reader->length = end != NULL ? (size_t)(end - reader->text) : reader->filled - reader->at;
    reader->at += reader->length + (end != NULL ? 1 : 0);
    if (reader->length > RECORDING_MAX_LINE) {
        reader->length = RECORDING_MAX_LINE;
        if (check_text(reader)) {
            fail(reader->failure, "%s:%lu: line is longer than %d characters", reader->path, reader->line,
                 RECORDING_MAX_LINE);
        }
        return LINE_BAD;
    }
    reader->text[reader->length] = '\0';
    if (reader->length > 0 && reader->text[reader->length - 1] == '\r') {
        reader->text[--reader->length] = '\0';
    }
    return LINE_READ;
}

/* Removes blanks at both ends, in place. */
static char *trim(char *text) {
    size_t length;
    text += strspn(text, " \t");
    length = strlen(text);
    while (length > 0 && (text[length - 1] == ' ' || text[length - 1] == '\t')) {
        length--;
    }
    text[length] = '\0';
    return text;
}

/* A unit of the same quantity as the column's own: its numbers are converted. */
static bool read_unit(reader_t *reader, column_t c, const char *key, const char *value) {
    double own, scale;
    if (reader->has_unit[c]) {
        return fail(reader->failure, "%s:%lu: second %s", reader->path, reader->line, key);
    }
    reader->has_unit[c] = true;
    if (unit_of(value, &scale) != unit_of(column_unit(c), &own)) {
        return fail(reader->failure, "%s:%lu: %s is '%s': right is %s, or a multiple of it", reader->path, reader->line,
                    key, value, column_unit(c));
    }
    reader->scale[c] = scale / own;
    return true;
}

/* The column whose unit a header key states, with this ending; COLUMN_COUNT: none. */
static column_t column_of_unit(const char *key, const char *ending) {
    column_t c = COLUMN_DRIVE;
    for (bool is = false; c < COLUMN_COUNT && !is; c += is ? 0 : 1) {
        const size_t length = strlen(column_name(c));
        is = strncmp(key, column_name(c), length) == 0 && strcmp(key + length, ending) == 0;
    }
    return c;
}

static bool ends_as_unit(const char *key) {
    const size_t length = strlen(key), ending = strlen(COLUMN_UNIT_KEY);
    return length > ending && strcmp(key + length - ending, COLUMN_UNIT_KEY) == 0;
}

bool recording_is_unit_key(const char *key) {
    return strcmp(key, "sample_rate_hz") == 0 || ends_as_unit(key);
}

static bool read_header(reader_t *reader) {
    recording_t *recording = reader->recording;
    char *key = reader->text + 1, *value = strchr(key, ':');
    if (reader->columns > 0) {
        return complain(reader, "header line after the column names");
    }
    if (value == NULL) { /* a remark */
        return true;
    }
    *value++ = '\0';
    key = trim(key);
    value = trim(value);
    recording_cut_cells(value);
    if (strcmp(key, "sample_rate_hz") == 0) {
        if (recording->sample_rate_hz > 0.0) {
            return complain(reader, "second sample_rate_hz");
        }
        if (!decimal_is(value, &recording->sample_rate_hz) || !(recording->sample_rate_hz > 0.0) ||
            recording->sample_rate_hz > RECORDING_FASTEST_HZ) {
            return fail(reader->failure, "%s:%lu: sample_rate_hz is not a positive number: '%s'", reader->path,
                        reader->line, value);
        }
        return true;
    }
    const column_t column = column_of_unit(key, COLUMN_UNIT_KEY), meant = column_of_unit(key, "_units");
    if (column != COLUMN_COUNT) {
        return read_unit(reader, column, key, value);
    }
    if (meant != COLUMN_COUNT) {
        return fail(reader->failure, "%s:%lu: %s is no header key: %s_unit is", reader->path, reader->line, key,
                    column_name(meant));
    }
    recording_set_key(recording, key, value);
    return true;
}

static int column_of_name(const char *name) {
    if (strcmp(name, "t") == 0) {
        return TIME_COLUMN;
    }
    for (column_t c = 0; c < COLUMN_COUNT; c++) {
        if (strcmp(name, column_name(c)) == 0) {
            return (int)c;
        }
    }
    return FURTHER_COLUMN;
}

static bool read_names(reader_t *reader) {
    bool seen[FURTHER_COLUMN] = {false};
    char *field = reader->text, *comma;
    double number;
    if (!(reader->recording->sample_rate_hz > 0.0)) {
        return complain(reader, "no header line '# sample_rate_hz: ...' before the column names");
    }
    do {
        int meaning;
        comma = strchr(field, ',');
        if (comma != NULL) {
            *comma = '\0';
        }
        if (reader->columns == MOST_FILE_COLUMNS) {
            return complain(reader, "too many columns");
        }
        field = trim(field);
        if (decimal_is(field, &number)) {
            return complain(reader, "a number where the column names should be (t,drive,displacement)");
        }
        meaning = column_of_name(field);
        if (meaning == FURTHER_COLUMN) {
            reader->further[reader->columns].name = copy_text(field);
        } else if (seen[meaning]) {
            return fail(reader->failure, "%s:%lu: column '%s' appears twice", reader->path, reader->line, field);
        } else {
            seen[meaning] = true;
        }
        reader->meaning[reader->columns++] = meaning;
        field = comma + 1;
    } while (comma != NULL);
    if (!seen[TIME_COLUMN] || !seen[COLUMN_DRIVE] || !seen[COLUMN_DISPLACEMENT]) {
        const char *missing = !seen[TIME_COLUMN] ? "t" : !seen[COLUMN_DRIVE] ? "drive" : "displacement";
        return fail(reader->failure, "%s:%lu: missing column '%s'", reader->path, reader->line, missing);
    }
    return true;
}

/* The time of sample k must be start + k / rate. A quarter of a period covers every rounding of a printed t. */
static bool check_time(reader_t *reader, size_t k) {
    const recording_t *recording = reader->recording;
    const double rate = recording->sample_rate_hz, step = (reader->time[1] - reader->time[0]) * rate;
    const double expected = recording->start_s + (double)k / rate;
    if (k == 0 || (fabs(step - 1.0) <= 0.5 && fabs(reader->time[1] - expected) * rate <= 0.25)) {
        return true;
    }
    if (!(step > 0.0)) {
        return fail(reader->failure, "%s:%lu: duplicate or backward time: t = %.9g s after %.9g s", reader->path,
                    reader->line, reader->time[1], reader->time[0]);
    }
    if (k == 1) {
        return fail(reader->failure,
                    "%s:%lu: wrong rate: the first samples are %.9g s apart, sample_rate_hz says %.9g s", reader->path,
                    reader->line, step / rate, 1.0 / rate);
    }
    if (fabs(step - 1.0) > 0.5) {
        return fail(reader->failure, "%s:%lu: gap: t goes from %.9g s to %.9g s, one sample is %.9g s", reader->path,
                    reader->line, reader->time[0], reader->time[1], 1.0 / rate);
    }
    return fail(reader->failure,
                "%s:%lu: wrong rate or uneven sampling: t = %.9g s where sample_rate_hz makes it %.9g s", reader->path,
                reader->line, reader->time[1], expected);
}

static void make_room(reader_t *reader) {
    recording_t *recording = reader->recording;
    if (recording->samples < reader->capacity) {
        return;
    }
    reader->capacity = reader->capacity > 0 ? 2 * reader->capacity : 4096;
    for (size_t i = 0; i < reader->columns; i++) {
        if (reader->meaning[i] != TIME_COLUMN) {
            double **column = reader->meaning[i] == FURTHER_COLUMN ? &reader->further[i].value
                                                                   : &recording->column[reader->meaning[i]];
            *column = reallocate(*column, reader->capacity, sizeof(double));
        }
    }
}

/* A number up to the next comma or the end of the line, with blanks around it. *field is then what follows it; false,
 * and nothing is done, if other text stands there. */
static bool take_number(char **field, double *number, bool *last) {
    const char *end = *field + strspn(*field, " \t");
    if (!decimal_read(end, '.', number, &end)) {
        return false;
    }
    end += strspn(end, " \t");
    if (*end != ',' && *end != '\0') {
        return false;
    }
    *last = *end == '\0';
    *field += end - *field + (*last ? 0 : 1);
    return true;
}

/* The text of a field, for a message: what follows is cut off. */
static const char *only_field(char *field, char *next) {
    if (next > field && next[-1] == ',') {
        next[-1] = '\0';
    }
    return trim(field);
}

/* A field of a further column that is no finite number: what it says. Words are not kept. */
static double no_number(further_t *further, const char *field) {
    static const struct {
        const char *text;
        double value;
    } said[] = {{"nan", (double)NAN}, {"inf", HUGE_VAL}, {"-inf", -HUGE_VAL}};
    const char *text = field + strspn(field, " \t");
    const size_t length = strcspn(text, " \t,");
    const char *behind = text + length + strspn(text + length, " \t");
    for (size_t i = 0; i < sizeof said / sizeof said[0]; i++) {
        if ((*behind == ',' || *behind == '\0') && length == strlen(said[i].text) &&
            strncasecmp(text, said[i].text, length) == 0) {
            further->numbers = true;
            return said[i].value;
        }
    }
    return (double)NAN;
}

static bool read_sample(reader_t *reader) {
    recording_t *recording = reader->recording;
    const size_t k = recording->samples;
    char *field = reader->text;
    make_room(reader);
    for (size_t i = 0; i < reader->columns; i++) {
        char *next = field;
        double number = 0.0;
        bool last;
        const bool plain = take_number(&next, &number, &last);
        if (!plain) {
            if (!check_text(reader)) {
                return false;
            }
            char *comma = strchr(field, ',');
            last = comma == NULL;
            next = last ? field + strlen(field) : comma + 1;
        }
        if (last != (i + 1 == reader->columns)) {
            return check_text(reader) && fail(reader->failure, "%s:%lu: ragged line, expected %zu columns",
                                              reader->path, reader->line, reader->columns);
        }
        if (!plain && reader->meaning[i] != FURTHER_COLUMN) {
            const char *name = reader->meaning[i] == TIME_COLUMN ? "t" : column_name((column_t)reader->meaning[i]);
            return fail(reader->failure, "%s:%lu: column '%s': '%s' is not a finite number", reader->path, reader->line,
                        name, only_field(field, next));
        }
        if (reader->meaning[i] == TIME_COLUMN) {
            reader->time[0] = reader->time[1];
            reader->time[1] = number;
        } else if (reader->meaning[i] == FURTHER_COLUMN) {
            further_t *further = &reader->further[i];
            further->numbers = further->numbers || plain;
            further->value[k] = plain ? number : no_number(further, field);
        } else {
            number *= reader->scale[reader->meaning[i]];
            if (fabs(number) > RECORDING_LARGEST) {
                const column_t column = (column_t)reader->meaning[i];
                return fail(reader->failure, "%s:%lu: column '%s': '%s' is not plausible: more than %g %s",
                            reader->path, reader->line, column_name(column), only_field(field, next), RECORDING_LARGEST,
                            column_unit(column));
            }
            recording->column[reader->meaning[i]][k] = number;
        }
        field = next;
    }
    if (field != reader->text + reader->length && !check_text(reader)) { /* a NUL ended it */
        return false;
    }
    if (k == 0) {
        recording->start_s = reader->time[1];
    }
    recording->samples++;
    return check_time(reader, k);
}

static bool read_lines(reader_t *reader) {
    line_t line;
    while ((line = read_line(reader)) == LINE_READ) {
        bool good;
        if (reader->text[0] == '#') {
            good = check_text(reader) && read_header(reader);
        } else if (reader->text[0] == '\0') {
            good = check_text(reader) && complain(reader, "empty line");
        } else if (reader->columns == 0) {
            good = check_text(reader) && read_names(reader);
        } else {
            good = read_sample(reader);
        }
        if (!good) {
            return false;
        }
    }
    if (line == LINE_BAD) {
        return false;
    }
    if (reader->line == 1) {
        return fail(reader->failure, "%s: empty file", reader->path);
    }
    if (reader->recording->samples < 2) {
        return fail(reader->failure, "%s:%lu: the recording ends after %zu samples", reader->path, reader->line - 1,
                    reader->recording->samples);
    }
    return true;
}

/* Whether a file begins with the header of a recording: comment lines, of which one is the sample rate. Where a
 * spreadsheet has written it anew, with semicolons or tabs between columns, it is imported. */
static bool has_header(const char *path) {
    char line[RECORDING_MAX_LINE + 2];
    bool found = false, more;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return false;
    }
    while ((more = fgets(line, sizeof line, file) != NULL) && line[0] == '#') {
        const char *key = line + 1 + strspn(line + 1, " \t");
        found = found || (strncmp(key, "sample_rate_hz", 14) == 0 && key[14 + strspn(key + 14, " \t")] == ':');
    }
    fclose(file);
    return found && !(more && strchr(line, ',') == NULL && strpbrk(line, ";\t") != NULL);
}

/* A key that is about a further column: no longer one of the recording's. To be freed; "" without. */
static char *take_key(recording_t *recording, const char *name, const char *what) {
    const size_t length = strlen(name);
    for (size_t i = 0; i < recording->keys; i++) {
        recording_key_t *key = &recording->key[i];
        if (strncmp(key->key, name, length) == 0 && strcmp(key->key + length, what) == 0) {
            char *value = key->value;
            free(key->key);
            recording->keys--;
            memmove(key, key + 1, (recording->keys - i) * sizeof *key);
            return value;
        }
    }
    return copy_text("");
}

static void keep_further(reader_t *reader) {
    for (size_t i = 0; i < reader->columns; i++) {
        const further_t *further = &reader->further[i];
        if (further->name != NULL) {
            char *unit = take_key(reader->recording, further->name, COLUMN_UNIT_KEY),
                 *long_name = take_key(reader->recording, further->name, COLUMN_LONG_NAME_KEY);
            if (further->numbers) {
                recording_add_extra(reader->recording, further->name, long_name, unit, further->value);
            }
            free(unit);
            free(long_name);
        }
    }
}

/* What is left is misspelt, and a column not in the unit that was meant. */
static bool check_unit_keys(const reader_t *reader) {
    for (size_t i = 0; i < reader->recording->keys; i++) {
        const char *key = reader->recording->key[i].key;
        if (ends_as_unit(key)) {
            return fail(reader->failure, "%s: %s is the unit of no column that is there", reader->path, key);
        }
    }
    return true;
}

static bool read_recording(recording_t *recording, const char *path, failure_t *failure) {
    reader_t *reader = allocate(1, sizeof *reader);
    bool good = false;
    memset(recording, 0, sizeof *recording);
    for (size_t c = 0; c < COLUMN_COUNT; c++) {
        reader->scale[c] = 1.0;
    }
    reader->path = path;
    reader->recording = recording;
    reader->failure = failure;
    reader->file = fopen(path, "rb");
    if (reader->file == NULL) {
        fail(failure, "%s: %s", path, strerror(errno));
    } else {
        recording->name = copy_text(shown_name(path));
        good = read_lines(reader);
        fclose(reader->file);
    }
    if (good) {
        keep_further(reader);
        good = check_unit_keys(reader);
    }
    if (!good) {
        recording_free(recording);
    }
    for (size_t i = 0; i < MOST_FILE_COLUMNS; i++) {
        free(reader->further[i].name);
        free(reader->further[i].value);
    }
    free(reader);
    return good;
}

/* For what results say of their origin. */
static void note_device(const recording_t *recording) {
    const char *device = recording_key(recording, RECORDING_DEVICE_KEY),
               *serial = recording_key(recording, RECORDING_SERIAL_KEY);
    char text[200];
    if (device == NULL && serial != NULL) {
        (void)snprintf(text, sizeof text, "serial number %s", serial);
        device = text;
    }
    if (device != NULL) {
        provenance_add_device(device);
    }
}

/* Whatever its header keys say. */
static bool read_any(recording_t *recording, const char *path, failure_t *failure) {
    const import_options_t nothing = import_nothing_said();
    memset(recording, 0, sizeof *recording);
    return hdf5_is_recording(path) ? hdf5_read_recording(recording, path, failure)
           : has_header(path)      ? read_recording(recording, path, failure)
                                   : import_file(recording, path, &nothing, failure);
}

bool recording_read(recording_t *recording, const char *path, failure_t *failure) {
    if (!read_any(recording, path, failure)) {
        return false;
    }
    if (!recording_check_keys(recording, failure)) {
        recording_free(recording);
        return false;
    }
    note_device(recording);
    return true;
}

bool recording_is_own(const char *path) {
    return hdf5_is_recording(path) || has_header(path);
}

/* The keys of an HDF5 file are read with all of it. */
static void take_keys_of_hdf5(recording_t *recording, const char *path) {
    recording_t own;
    failure_t ignored;
    if (hdf5_read_recording(&own, path, &ignored)) {
        for (size_t i = 0; i < own.keys; i++) {
            recording_set_key(recording, own.key[i].key, own.key[i].value);
        }
        recording_free(&own);
    }
}

void recording_take_keys(recording_t *recording, const char *path) {
    if (hdf5_is_recording(path)) {
        take_keys_of_hdf5(recording, path);
    } else {
        recording_take_header(recording, path);
    }
}
