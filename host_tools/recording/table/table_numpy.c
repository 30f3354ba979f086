/* SPDX-License-Identifier: GPL-3.0-or-later */
/* NumPy's .npy, format versions 1 to 3, and .npz by libzip. The header is a Python literal with three known keys. */
#include "recording/table/table.h"
#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zip.h>

enum { MOST_FIELDS = 64 };

typedef struct {
    char name[64];
    char kind;    /* 'f', 'i', 'u', 'b' */
    char unit[8]; /* of a date or a time difference, else "" */
    size_t size, offset;
    bool swapped;
} array_field_t;

typedef struct {
    size_t fields, item; /* bytes an element */
    array_field_t field[MOST_FIELDS];
    bool fortran;
    size_t rows, columns, dimensions;
    size_t data; /* where the numbers begin */
} array_t;

/* "<f8" into a field. */
static bool parse_type(const char *text, array_field_t *field) {
    const int one = 1;
    const bool little = *(const char *)&one == 1;
    char *end;
    field->swapped = (*text == '>' && little) || (*text == '<' && !little);
    if (strchr("<>|=", *text) != NULL && *text != '\0') {
        text++;
    }
    if (*text == 'M' || *text == 'm') { /* "<M8[ns]" */
        const size_t length = strncmp(text + 1, "8[", 2) == 0 ? strcspn(text + 3, "]") : 0;
        (void)snprintf(field->unit, sizeof field->unit, "%.*s", (int)length, text + 3);
        field->kind = 'i';
        field->size = sizeof(int64_t);
        return length > 0 && length < sizeof field->unit;
    }
    field->kind = *text;
    if (*text == '\0' || strchr("fiub", *text) == NULL) {
        return false;
    }
    field->size = strtoul(text + 1, &end, 10);
    return end != text + 1 &&
           (*text == 'f' ? field->size == 2 || field->size == 4 || field->size == 8
                         : field->size == 1 || field->size == 2 || field->size == 4 || field->size == 8);
}

/* The text in quotes behind `at`. Returns what comes behind it, or NULL. */
static const char *quoted(const char *at, char *text, size_t room) {
    const char *begin = at != NULL ? strpbrk(at, "'\"") : NULL;
    const char *end = begin != NULL ? strchr(begin + 1, *begin) : NULL;
    if (end == NULL || (size_t)(end - begin) > room) {
        return NULL;
    }
    memcpy(text, begin + 1, (size_t)(end - begin - 1));
    text[end - begin - 1] = '\0';
    return end + 1;
}

static bool parse_fields(const char *descr, array_t *array) {
    char text[64];
    descr += strspn(descr, " ");
    if (*descr != '[') {
        array->fields = 1;
        if (quoted(descr, text, sizeof text) == NULL || !parse_type(text, &array->field[0])) {
            return false;
        }
        array->item = array->field[0].size;
        return true;
    }
    while (*descr != ']' && array->fields < MOST_FIELDS) {
        array_field_t *field = &array->field[array->fields++];
        descr = quoted(descr, field->name, sizeof field->name);
        descr = quoted(descr, text, sizeof text);
        if (descr == NULL || !parse_type(text, field)) {
            return false;
        }
        field->offset = array->item;
        array->item += field->size;
        descr += strspn(descr, " ");
        if (*descr != ')') {
            return false; /* a field of several numbers */
        }
        descr += 1 + strspn(descr + 1, ", ");
    }
    return array->fields > 0;
}

/* "(400, 3)" into rows and columns. Dimensions of one element are none. false: more than two are left. */
static bool parse_shape(const char *shape, array_t *array) {
    const char *at = strchr(shape, '(');
    size_t read = 0;
    array->rows = array->columns = 1;
    array->dimensions = 0;
    while (at != NULL && isdigit((unsigned char)*(at + 1 + strspn(at + 1, " ")))) {
        char *end;
        const unsigned long long size = strtoull(at + 1, &end, 10);
        if (size != 1) {
            *(read == 0 ? &array->rows : &array->columns) = (size_t)size;
            read++;
        }
        array->dimensions++;
        at = *end == ',' ? end : NULL;
    }
    return read <= 2 && (array->dimensions > 0 || strncmp(shape + strspn(shape, " "), "()", 2) == 0);
}

static bool parse_header(const unsigned char *bytes, size_t length, array_t *array) {
    char *header;
    const char *descr, *order, *shape;
    size_t begin, size;
    bool good = false;
    memset(array, 0, sizeof *array);
    if (length < 12 || memcmp(bytes, "\x93NUMPY", 6) != 0 || bytes[6] < 1 || bytes[6] > 3) {
        return false;
    }
    begin = bytes[6] == 1 ? 10 : 12;
    size = bytes[8] + 256u * bytes[9];
    if (bytes[6] > 1) {
        size += 65536u * bytes[10] + 16777216u * (size_t)bytes[11];
    }
    if (size > length - begin || size > 65536) {
        return false;
    }
    header = allocate(size + 1, 1);
    memcpy(header, bytes + begin, size);
    header[size] = '\0';
    array->data = begin + size;
    descr = strstr(header, "'descr':");
    order = strstr(header, "'fortran_order':");
    shape = strstr(header, "'shape':");
    if (descr != NULL && order != NULL && shape != NULL && parse_fields(descr + 8, array)) {
        array->fortran = strstr(order, "True") == order + strlen("'fortran_order': ");
        good = parse_shape(shape + 8, array) && array->rows > 0 && array->columns > 0 &&
               array->rows <= SIZE_MAX / array->columns / array->item &&
               array->rows * array->columns * array->item <= length - array->data;
    }
    free(header);
    return good;
}

/* IEEE 754 with 5 bits of exponent and 10 of mantissa: no type of C has it. */
static double half(uint16_t bits) {
    const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
    const double size = exponent == 31  ? (mantissa == 0 ? (double)INFINITY : (double)NAN)
                        : exponent == 0 ? ldexp(mantissa, -24)
                                        : ldexp(1024 + mantissa, exponent - 25);
    return bits >> 15 ? -size : size;
}

static double number_at(const unsigned char *bytes, const array_field_t *field) {
    unsigned char raw[8] = {0};
    union {
        double f8;
        float f4;
        int64_t i8;
        uint64_t u8;
        int32_t i4;
        uint32_t u4;
        int16_t i2;
        uint16_t u2;
        int8_t i1;
        uint8_t u1;
    } value = {0};
    for (size_t i = 0; i < field->size; i++) {
        raw[i] = bytes[field->swapped ? field->size - 1 - i : i];
    }
    memcpy(&value, raw, field->size);
    if (field->kind == 'f') {
        return field->size == 8 ? value.f8 : field->size == 4 ? (double)value.f4 : half(value.u2);
    }
    switch (field->size) {
    case 1:
        return field->kind == 'i' ? (double)value.i1 : (double)value.u1;
    case 2:
        return field->kind == 'i' ? (double)value.i2 : (double)value.u2;
    case 4:
        return field->kind == 'i' ? (double)value.i4 : (double)value.u4;
    default:
        return field->kind == 'i' ? (double)value.i8 : (double)value.u8;
    }
}

static bool take(table_t *table, const char *name, const unsigned char *bytes, size_t length, size_t *dimensions) {
    array_t *array = allocate(1, sizeof *array);
    const bool good = parse_header(bytes, length, array);
    *dimensions = array->dimensions;
    for (size_t f = 0; good && f < array->fields; f++) {
        const size_t count = array->rows * array->columns;
        double *value = allocate(count, sizeof *value);
        for (size_t i = 0; i < count; i++) {
            value[i] = number_at(bytes + array->data + i * array->item + array->field[f].offset, &array->field[f]);
        }
        char called[80];
        const bool unit = array->field[f].unit[0] != '\0';
        (void)snprintf(called, sizeof called, "%.60s%s%s%s", array->fields > 1 ? array->field[f].name : name,
                       unit ? " [" : "", array->field[f].unit, unit ? "]" : "");
        table_add_array(table, called, value, array->rows, array->columns, !array->fortran);
        free(value);
    }
    free(array);
    return good;
}

bool table_read_numpy(table_t *table, const char *path, failure_t *failure) {
    FILE *file = fopen(path, "rb");
    unsigned char *bytes = NULL;
    long length = -1;
    size_t dimensions = 0;
    bool good = false;
    if (file != NULL && fseek(file, 0, SEEK_END) == 0 && (length = ftell(file)) > 0 && fseek(file, 0, SEEK_SET) == 0) {
        bytes = allocate((size_t)length, 1);
        good = fread(bytes, 1, (size_t)length, file) == (size_t)length;
    }
    if (file != NULL) {
        fclose(file);
    }
    table_open(table, path, "NumPy array");
    if (!good) {
        fail(failure, "%s: %s", path, strerror(errno));
    } else if (!take(table, "column", bytes, (size_t)length, &dimensions)) {
        good = dimensions > 2 ? fail(failure, "%s: an array of %zu dimensions: save one run of it, samples by signals",
                                     path, dimensions)
                              : fail(failure, "%s: a NumPy file that is not whole, or no array of real numbers", path);
    } else if (table->columns == 0) {
        good = fail(failure, "%s: the array is no signal", path);
    }
    free(bytes);
    if (!good) {
        table_free(table);
    }
    return good;
}

bool table_read_numpy_archive(table_t *table, const char *path, failure_t *failure) {
    int error = 0;
    zip_t *archive = zip_open(path, ZIP_RDONLY, &error);
    bool arrays = false;
    if (archive == NULL) {
        return fail(failure, "%s: a zip archive that cannot be read: is it whole?", path);
    }
    table_open(table, path, "NumPy archive");
    for (zip_int64_t i = 0; i < zip_get_num_entries(archive, 0); i++) {
        zip_stat_t stat;
        zip_file_t *file = zip_fopen_index(archive, (zip_uint64_t)i, 0);
        if (file != NULL && zip_stat_index(archive, (zip_uint64_t)i, 0, &stat) == 0 &&
            stat.size < (zip_uint64_t)1 << 36) {
            const size_t name_length = strlen(stat.name);
            if (name_length > 4 && strcmp(stat.name + name_length - 4, ".npy") == 0) {
                unsigned char *bytes = allocate((size_t)stat.size, 1);
                char name[200];
                size_t dimensions;
                snprintf(name, sizeof name, "%.*s", (int)(name_length - 4), stat.name);
                arrays = true;
                if (zip_fread(file, bytes, stat.size) != (zip_int64_t)stat.size ||
                    !take(table, name, bytes, (size_t)stat.size, &dimensions)) {
                    table_note(table, "%s is no array of real numbers with one or two dimensions", name);
                }
                free(bytes);
            }
        }
        if (file != NULL) {
            zip_fclose(file);
        }
    }
    zip_close(archive);
    if (table->columns == 0) {
        fail(failure, "%s: %s", path,
             arrays ? "no array in it is a signal"
                    : "a zip archive without NumPy arrays (a spreadsheet? save it as CSV)");
        table_free(table);
        return false;
    }
    return true;
}
