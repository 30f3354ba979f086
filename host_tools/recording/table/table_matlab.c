/* SPDX-License-Identifier: GPL-3.0-or-later */
/* MATLAB files of version 5, by libmatio: arrays of numbers, in structures, too. */
#include "recording/table/table.h"
#include <matio.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEEPEST = 6, MOST_CELLS = 64, NAME_ROOM = 256 };

/* The numbers of an array in double, column after column, or NULL if it holds none. */
static double *numbers_of(const matvar_t *variable, size_t count) {
    double *value;
    /* Of a sparse matrix there are fewer numbers than elements. */
    const bool numbers = variable->class_type >= MAT_C_DOUBLE && variable->class_type <= MAT_C_UINT64;
    if (variable->isComplex || variable->data == NULL || !numbers) {
        return NULL;
    }
    value = allocate(count, sizeof *value);
    for (size_t i = 0; i < count; i++) {
        switch (variable->data_type) {
        case MAT_T_DOUBLE:
            value[i] = ((const double *)variable->data)[i];
            break;
        case MAT_T_SINGLE:
            value[i] = (double)((const float *)variable->data)[i];
            break;
        case MAT_T_INT64:
            value[i] = (double)((const int64_t *)variable->data)[i];
            break;
        case MAT_T_UINT64:
            value[i] = (double)((const uint64_t *)variable->data)[i];
            break;
        case MAT_T_INT32:
            value[i] = (double)((const int32_t *)variable->data)[i];
            break;
        case MAT_T_UINT32:
            value[i] = (double)((const uint32_t *)variable->data)[i];
            break;
        case MAT_T_INT16:
            value[i] = (double)((const int16_t *)variable->data)[i];
            break;
        case MAT_T_UINT16:
            value[i] = (double)((const uint16_t *)variable->data)[i];
            break;
        case MAT_T_INT8:
            value[i] = (double)((const int8_t *)variable->data)[i];
            break;
        case MAT_T_UINT8:
            value[i] = (double)((const uint8_t *)variable->data)[i];
            break;
        default:
            free(value);
            return NULL;
        }
    }
    return value;
}

/* The name of what is in a variable. A longer one is cut. */
__attribute__((format(printf, 2, 3))) static void write_name(char text[NAME_ROOM], const char *format, ...) {
    va_list values;
    va_start(values, format);
    (void)vsnprintf(text, NAME_ROOM, format, values);
    va_end(values);
}

/* The text of a variable without quotes, in UTF-8: its length, 0 if it is none. */
static size_t text_of(const matvar_t *variable, char *text, size_t room) {
    size_t count = variable != NULL && variable->class_type == MAT_C_CHAR && variable->data != NULL ? 1 : 0, used = 0;
    for (int i = 0; count > 0 && i < variable->rank; i++) {
        count *= variable->dims[i];
    }
    const bool wide = count > 0 && (variable->data_type == MAT_T_UINT16 || variable->data_type == MAT_T_UTF16);
    const size_t there = count > 0 ? variable->nbytes / (wide ? sizeof(uint16_t) : 1) : 0; /* a damaged file has less */
    for (size_t i = 0; i < count && i < there && used + 3 < room; i++) {
        const unsigned letter =
            wide ? ((const uint16_t *)variable->data)[i] : (unsigned)((const uint8_t *)variable->data)[i];
        if (wide && letter >= 0x80 && letter < 0x800) {
            text[used++] = (char)(0xC0 | (letter >> 6));
            text[used++] = (char)(0x80 | (letter & 0x3F));
        } else if (letter < 0x100 && letter != '"' && letter >= ' ') {
            text[used++] = (char)letter;
        }
    }
    text[used] = '\0';
    return used;
}

static matvar_t *field_of(matvar_t *structure, size_t index, const char *const *names, size_t count) {
    for (size_t i = 0; i < count; i++) {
        matvar_t *field = Mat_VarGetStructFieldByName(structure, names[i], index);
        if (field != NULL) {
            return field;
        }
    }
    return NULL;
}

/* An element of a structure that is a signal: its numbers beside their name and unit (dSPACE, Simulink). The name goes
 * into `text` behind that of the structure. NULL: it is something else. */
static matvar_t *signal_of(matvar_t *structure, size_t index, const char *name, char text[NAME_ROOM]) {
    static const char *const data[] = {"Data", "values", "data"}, *const names[] = {"Name", "label", "name"},
                             *const units[] = {"Unit", "unit", "Units", "units"};
    char called[150], unit[40];
    matvar_t *numbers = field_of(structure, index, data, sizeof data / sizeof data[0]);
    if (numbers == NULL ||
        text_of(field_of(structure, index, names, sizeof names / sizeof names[0]), called, sizeof called) == 0) {
        return NULL;
    }
    const bool stated =
        text_of(field_of(structure, index, units, sizeof units / sizeof units[0]), unit, sizeof unit) > 0;
    write_name(text, "%s.%s%s%s%s", name, called, stated ? " [" : "", stated ? unit : "", stated ? "]" : "");
    return numbers;
}

/* The number of a field of a structure, which is one alone; false: it is something else. */
static bool one_number(matvar_t *structure, unsigned field, size_t index, double *number) {
    const matvar_t *const variable = Mat_VarGetStructFieldByIndex(structure, field, index);
    if (variable == NULL || variable->rank != 2 || variable->dims[0] != 1 || variable->dims[1] != 1) {
        return false;
    }
    double *const value = numbers_of(variable, 1);
    if (value != NULL) {
        *number = value[0];
        free(value);
    }
    return value != NULL;
}

/* A structure for each sample: the fields that are one number in all of them are signals. false: no field is. */
static bool take_samples(table_t *table, matvar_t *structure, size_t count, const char *name) {
    const unsigned fields = Mat_VarGetNumberOfFields(structure);
    char *const *names = Mat_VarGetStructFieldnames(structure);
    bool any = false;
    double *value = allocate(count, sizeof *value);
    for (unsigned field = 0; field < fields && count > 2; field++) {
        size_t k = 0;
        while (k < count && one_number(structure, field, k, &value[k])) {
            k++;
        }
        if (k == count) {
            char text[NAME_ROOM];
            write_name(text, "%s.%s", name, names[field]);
            table_add_array(table, text, value, count, 1, false);
            any = true;
        }
    }
    free(value);
    return any;
}

static void take(table_t *table, matvar_t *variable, const char *name, int depth);

/* NOLINTNEXTLINE(misc-no-recursion): at most DEEPEST structures in each other */
static void take_element(table_t *table, matvar_t *structure, size_t index, size_t count, const char *name, int depth) {
    char text[NAME_ROOM];
    matvar_t *const signal = signal_of(structure, index, name, text);
    if (signal != NULL) {
        take(table, signal, text, depth + 1);
        return;
    }
    const unsigned fields = Mat_VarGetNumberOfFields(structure);
    char *const *names = Mat_VarGetStructFieldnames(structure);
    for (unsigned i = 0; i < fields; i++) {
        matvar_t *field = Mat_VarGetStructFieldByIndex(structure, i, index);
        if (count > 1) {
            write_name(text, "%s(%zu).%s", name, index + 1, names[i]);
        } else {
            write_name(text, "%s.%s", name, names[i]);
        }
        if (field != NULL) {
            take(table, field, text, depth + 1);
        }
    }
}

/* The size of an array without dimensions of one element; false: more than two are left. */
static bool get_size(const matvar_t *variable, size_t size[2]) {
    size_t kept = 0;
    size[0] = size[1] = 1;
    for (int i = 0; i < variable->rank; i++) {
        if (variable->dims[i] != 1 && kept++ < 2) {
            size[kept - 1] = variable->dims[i];
        }
    }
    return kept <= 2;
}

/* NOLINTNEXTLINE(misc-no-recursion): as above */
static void take(table_t *table, matvar_t *variable, const char *name, int depth) {
    size_t count = 1;
    for (int i = 0; i < variable->rank; i++) {
        count *= variable->dims[i];
    }
    if (variable->class_type == MAT_C_STRUCT && depth < DEEPEST) {
        if (take_samples(table, variable, count, name)) {
            return;
        }
        for (size_t i = 0; i < count; i++) {
            take_element(table, variable, i, count, name, depth);
        }
        return;
    }
    for (size_t i = 0; variable->class_type == MAT_C_CELL && i < count && i < MOST_CELLS && depth < DEEPEST; i++) {
        char text[NAME_ROOM];
        matvar_t *const cell = Mat_VarGetCell(variable, (int)i);
        write_name(text, "%s{%zu}", name, i + 1);
        if (cell != NULL) {
            take(table, cell, text, depth + 1);
        }
    }
    if (variable->class_type == MAT_C_CELL) {
        return;
    }
    size_t size[2];
    if (get_size(variable, size) && count > 0) {
        double *value = numbers_of(variable, count);
        if (value != NULL) {
            table_add_array(table, name, value, size[0], size[1], false);
            free(value);
            return;
        }
    }
    table_note(table, "%s %s", name,
               variable->class_type == MAT_C_SPARSE ? "is a sparse matrix: save full() of it"
               : variable->isComplex                ? TABLE_COMPLEX
                                                    : "is no array of real numbers");
}

bool table_read_matlab(table_t *table, const char *path, failure_t *failure) {
    mat_t *file = Mat_Open(path, MAT_ACC_RDONLY);
    matvar_t *variable;
    size_t objects = 0;
    if (file == NULL) {
        return fail(failure, "%s: a MATLAB file that cannot be read: is it whole?", path);
    }
    table_open(table, path, Mat_GetVersion(file) == MAT_FT_MAT4 ? "MATLAB 4" : "MATLAB 5");
    while ((variable = Mat_VarReadNext(file)) != NULL) {
        const char *name = variable->name != NULL ? variable->name : "";
        objects += variable->class_type == MAT_C_OPAQUE ? 1 : 0;
        if (name[0] != '\0' && name[0] != '#') { /* what objects consist of is kept without a name */
            take(table, variable, name, 0);
        }
        Mat_VarFree(variable);
    }
    Mat_Close(file);
    if (objects > 0) {
        table_note(table, "%zu object%s of a MATLAB class", objects, objects == 1 ? "" : "s");
    }
    if (table->columns == 0) {
        fail(failure, "%s: no variable in it is a signal (a vector or matrix of real numbers)%s", path,
             objects > 0 ? MATLAB_OBJECTS : "");
        table_free(table);
        return false;
    }
    return true;
}
