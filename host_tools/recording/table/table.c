/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/table.h"
#include "base/shown_name.h"
#include "recording/table/units.h"
#include <ctype.h>
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

void table_open(table_t *table, const char *path, const char *kind) {
    memset(table, 0, sizeof *table);
    table->source = copy_text(shown_name(path));
    table->kind = copy_text(kind);
}

static void drop_columns(table_t *table) {
    for (size_t i = 0; i < table->columns; i++) {
        free(table->column[i].name);
        free(table->column[i].written);
        free(table->column[i].unit);
        free(table->column[i].origin);
        free(table->column[i].value);
    }
    free(table->column);
    table->column = NULL;
    table->columns = 0;
}

void table_free(table_t *table) {
    drop_columns(table);
    for (size_t i = 0; i < table->notes; i++) {
        free(table->note[i]);
    }
    free(table->note);
    for (size_t i = 0; i < COLUMN_COUNT; i++) {
        free(table->role_unit[i]);
    }
    free(table->interval_origin);
    free(table->source);
    free(table->kind);
    free(table->damage);
    free(table->unnamed);
    free(table->unnamed_line);
    free(table->partial);
    free(table->passed_before);
    memset(table, 0, sizeof *table);
}

unsigned long table_line(const table_t *table, size_t row) {
    size_t low = 0, high = table->passed;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (table->passed_before[middle] <= row) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return table->first_line > 0 ? table->first_line + (unsigned long)(row + low) : 0;
}

/* A name that is nothing but a unit: "nm", "millis". One letter is a name more often, and "min" the smallest. */
static bool is_unit_alone(const char *name) {
    double scale;
    const quantity_t quantity = unit_of(name, &scale);
    return strlen(name) > 1 && strcmp(name, "min") != 0 &&
           (quantity == QUANTITY_TIME || quantity == QUANTITY_VOLTAGE || quantity == QUANTITY_LENGTH);
}

void table_add(table_t *table, const char *name, const char *unit, const char *written, double *value) {
    table_column_t *column;
    table->column = reallocate(table->column, table->columns + 1, sizeof *table->column);
    column = &table->column[table->columns++];
    column->name = copy_text(name);
    column->unit = copy_text(unit[0] == '\0' && is_unit_alone(name) ? name : unit);
    column->written = copy_text(written != NULL ? written : name);
    column->origin = NULL;
    column->value = value;
    column->number = table->columns;
    column->clock = false;
    column->scaled = false;
}

void table_note(table_t *table, const char *format, ...) {
    char text[400];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    table->note = reallocate(table->note, table->notes + 1, sizeof *table->note);
    table->note[table->notes++] = copy_text(text);
}

/* Whether a name is that one, but for capitals and what joins words. */
static bool is_called(const char *name, const char *wanted) {
    while (*name != '\0') {
        if (*name != '_' && *name != ' ') {
            if (tolower((unsigned char)*name) != *wanted++) {
                return false;
            }
        }
        name++;
    }
    return *wanted == '\0';
}

/* A single number that says how the rest was sampled. */
static bool take_rate(table_t *table, const char *name, double number) {
    static const struct {
        const char *name;
        bool rate;
    } known[] = {{"fs", true},
                 {"samplerate", true},
                 {"samplingrate", true},
                 {"samplefrequency", true},
                 {"samplingfrequency", true},
                 {"framerate", true},
                 {"sr", true},
                 {"rate", true},
                 {"dt", false},
                 {"ts", false},
                 {"tinterval", false},
                 {"samplingperiod", false},
                 {"sampletime", false},
                 {"timestep", false},
                 {"interval", false},
                 {"samplinginterval", false},
                 {"sampleinterval", false}};
    const char *last = name + strlen(name);
    char plain[UNIT_FIELD], unit[UNIT_FIELD];
    double scale = 1.0;
    while (last > name && last[-1] != '.' && last[-1] != '/') {
        last--;
    }
    if (snprintf(plain, sizeof plain, "%s", last) >= (int)sizeof plain) {
        return false;
    }
    unit_split(plain, unit, "_");
    const quantity_t quantity = unit_of(unit, &scale);
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        const bool fits = unit[0] == '\0' || quantity == (known[i].rate ? QUANTITY_FREQUENCY : QUANTITY_TIME);
        if (number > 0.0 && fits && is_called(plain, known[i].name)) {
            table_set_interval(table, known[i].rate ? 1.0 / (number * scale) : number * scale, name);
            return true;
        }
    }
    return false;
}

void table_set_interval(table_t *table, double interval_s, const char *origin) {
    table->interval_s = interval_s;
    free(table->interval_origin);
    table->interval_origin = copy_text(origin);
}

void table_add_array(table_t *table, const char *name, const double *value, size_t rows, size_t columns,
                     bool row_major) {
    const bool lying = rows < columns; /* signals in rows: one a row */
    const size_t samples = lying ? columns : rows, signals = lying ? rows : columns;
    if (samples == 1 && signals == 1 && take_rate(table, name, value[0])) {
        return;
    }
    if (samples < 2 || signals == 0) {
        table_note(table, "%s" TABLE_ONE_NUMBER, name);
        return;
    }
    if (table->columns > 0 && samples < table->rows) {
        table_note(table, "%s has %zu samples where others have %zu", name, samples, table->rows);
        return;
    }
    if (table->columns > 0 && samples > table->rows) {
        for (size_t i = 0; i < table->columns; i++) {
            table_note(table, "%s has %zu samples where %s has %zu", table->column[i].name, table->rows, name, samples);
        }
        drop_columns(table);
    }
    char plain[UNIT_FIELD], unit[UNIT_FIELD] = "";
    const bool short_name = snprintf(plain, sizeof plain, "%s", name) < (int)sizeof plain;
    if (short_name) {
        unit_split(plain, unit, "_");
        if (plain[0] == '\0') { /* "[ms]" */
            snprintf(plain, sizeof plain, "%s", name);
        }
    }
    table->rows = samples;
    for (size_t i = 0; i < signals; i++) {
        char text[300], written[300];
        double *one = allocate(samples, sizeof *one);
        for (size_t k = 0; k < samples; k++) {
            const size_t row = lying ? i : k, column = lying ? k : i;
            one[k] = value[row_major ? row * columns + column : column * rows + row];
        }
        if (signals > 1) {
            snprintf(text, sizeof text, "%s %zu", short_name ? plain : name, i + 1);
            snprintf(written, sizeof written, "%s %zu", name, i + 1);
        } else {
            snprintf(text, sizeof text, "%s", short_name ? plain : name);
            snprintf(written, sizeof written, "%s", name);
        }
        table_add(table, text, unit, written, one);
    }
}

/* How the first bytes of a file say what it is. */
typedef struct {
    const char *bytes;
    size_t length;
    bool (*read)(table_t *table, const char *path, failure_t *failure); /* NULL: refused */
    const char *what;                                                   /* and, of what is refused, why */
} signature_t;

enum { HEAD = 32 };

#define UNIVERSAL_FILE "a Universal File (UFF), as vibrometers write: export the signals as text"

#define PACKED     "packed in another way than gzip: unpack it first"
#define JSON_FILE  "JSON, no table of measurements: save it as CSV"
#define SCOPE_FILE "an oscilloscope's own file: export the waveforms as CSV"

static const signature_t signatures[] = {
    {"\x89HDF\r\n\x1a\n", 8, table_read_hdf5, "HDF5"},
    {"MATLAB 5.0 MAT-file", 19, table_read_matlab, "a MATLAB file"},
    {"MATLAB 7.3 MAT-file", 19, table_read_hdf5, "a MATLAB file"},
    {"\x93NUMPY", 6, table_read_numpy, "a NumPy array"},
    {"PK\x03\x04", 4, table_read_numpy_archive, "an archive (NumPy .npz?)"},
    {"TDSm", 4, NULL,
     "a LabVIEW TDMS file, which the Python package reads: hyst.read(FILE).write('x.csv'); or export it as text"},
    {"%PDF", 4, NULL, "a PDF document, no measurements"},
    {"\x89PNG", 4, NULL, "a picture, no measurements"},
    {"    -1\n", 7, NULL, UNIVERSAL_FILE},
    {"    -1\r", 7, NULL, UNIVERSAL_FILE},
    {"BZh", 3, NULL, PACKED},
    {"\xFD\x37zXZ", 5, NULL, PACKED},
    {"\x28\xB5\x2F\xFD", 4, NULL, PACKED},
    {"7z\xBC\xAF", 4, NULL, PACKED},
    {"Rar!", 4, NULL, PACKED},
    {"RIFF", 4, NULL, "a sound file, whose numbers are parts of full scale: export volts as CSV"},
    {"{\\rtf", 5, NULL, "a text with fonts (RTF): save it as plain text"},
    {"PAR1", 4, NULL, "a Parquet file: save it as CSV, or as NumPy arrays"},
    {"ARROW1", 6, NULL, "an Arrow file: save it as CSV, or as NumPy arrays"},
    {"SQLite format 3", 15, NULL, "a data base: export the table as CSV"},
    {":WFM", 4, NULL, SCOPE_FILE},
    {"WFMP", 4, NULL, SCOPE_FILE},
    {"<", 1, NULL, "HTML or XML, no table of measurements as text: save it as CSV"},
    {"[[", 2, NULL, JSON_FILE},
    {"[{", 2, NULL, JSON_FILE},
    {"[\n", 2, NULL, JSON_FILE},
    {"{", 1, NULL, "JSON (a model of this project?), no table of measurements"},
    {"\xd0\xcf\x11\xe0", 4, NULL, "an old Excel workbook: save it as CSV"},
};

/* MATLAB's version 4 begins with numbers: type, size, whether it is complex, and the length of the name. */
static bool is_matlab_4(const char head[HEAD], size_t length) {
    int32_t number[5];
    char name = 0;
    if (length < sizeof number + 1) {
        return false;
    }
    memcpy(number, head, sizeof number);
    memcpy(&name, head + sizeof number, 1);
    const bool type = number[0] >= 0 && number[0] <= 52 && number[0] % 10 <= 2;
    const bool size = number[1] > 0 && number[2] > 0 && (number[3] == 0 || number[3] == 1);
    return type && size && number[4] > 1 && number[4] <= 64 && isalpha((unsigned char)name);
}

/* NULL: none of them. */
static const signature_t *find_signature(const char head[HEAD], size_t length) {
    static const signature_t matlab_4 = {"", 0, table_read_matlab, "a MATLAB file"}, lecroy = {"", 0, NULL, SCOPE_FILE};
    static const char wavedesc[] = "WAVEDESC"; /* behind "#9" and a length */
    if (is_matlab_4(head, length)) {
        return &matlab_4;
    }
    for (size_t i = 0; i + strlen(wavedesc) <= length && i < HEAD / 2; i++) {
        if (memcmp(head + i, wavedesc, strlen(wavedesc)) == 0) {
            return &lecroy;
        }
    }
    for (size_t i = 0; i < sizeof signatures / sizeof signatures[0]; i++) {
        if (length >= signatures[i].length && memcmp(head, signatures[i].bytes, signatures[i].length) == 0) {
            return &signatures[i];
        }
    }
    return NULL;
}

/* What is in a gzip, if that is no text. Of a damaged one nothing is said here: its text is read next. */
static const signature_t *find_packed(const char *path) {
    char head[HEAD] = {0};
    gzFile file = gzopen(path, "rb");
    const int got = file != NULL ? gzread(file, head, HEAD) : -1;
    if (file != NULL) {
        gzclose(file);
    }
    return got > 0 ? find_signature(head, (size_t)got) : NULL;
}

static bool read_any(table_t *table, const char *path, failure_t *failure) {
    char head[HEAD] = {0};
    size_t length;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return fail(failure, "%s: %s", path, strerror(errno));
    }
    length = fread(head, 1, sizeof head, file);
    if (ferror(file)) {
        fail(failure, "%s: %s", path, strerror(errno));
        fclose(file);
        return false;
    }
    fclose(file);
    if (length == 0) {
        return fail(failure, "%s: empty file", path);
    }
    const signature_t *signature = find_signature(head, length);
    if (signature != NULL) {
        return signature->read != NULL ? signature->read(table, path, failure)
                                       : fail(failure, "%s: %s", path, signature->what);
    }
    const bool gzip = length >= 2 && memcmp(head, "\x1f\x8b", 2) == 0;
    signature = gzip ? find_packed(path) : NULL;
    if (signature != NULL) {
        return fail(failure, "%s: gzip of %s%s", path, signature->what,
                    signature->read != NULL ? ": only text is read from gzip, unpack it first (gunzip)" : "");
    }
    return table_read_text(table, path, failure);
}

bool table_read(table_t *table, const char *path, failure_t *failure) {
    const bool good = read_any(table, path, failure);
    if (good) {
        table_join_times(table);
    }
    return good;
}
