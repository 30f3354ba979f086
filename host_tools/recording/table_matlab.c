/* SPDX-License-Identifier: GPL-3.0-or-later */
/* MATLAB files of version 5, by libmatio: arrays of numbers, in structures, too. */
#include "recording/table.h"
#include <matio.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEEPEST = 6 };

/* The numbers of an array in double, column after column, or NULL if it holds none. */
static double *numbers_of(const matvar_t *variable, size_t count) {
    double *value;
    if (variable->isComplex || variable->data == NULL) {
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

/* NOLINTNEXTLINE(misc-no-recursion): at most DEEPEST structures in each other */
static void take(table_t *table, matvar_t *variable, const char *name, int depth) {
    size_t count = 1;
    for (int i = 0; i < variable->rank; i++) {
        count *= variable->dims[i];
    }
    if (variable->class_type == MAT_C_STRUCT && count == 1 && depth < DEEPEST) {
        const unsigned fields = Mat_VarGetNumberOfFields(variable);
        char *const *names = Mat_VarGetStructFieldnames(variable);
        for (unsigned i = 0; i < fields; i++) {
            matvar_t *field = Mat_VarGetStructFieldByIndex(variable, i, 0);
            char text[256];
            snprintf(text, sizeof text, "%s.%s", name, names[i]);
            if (field != NULL) {
                take(table, field, text, depth + 1);
            }
        }
        return;
    }
    if (variable->rank == 2 && count > 0) {
        double *value = numbers_of(variable, count);
        if (value != NULL) {
            table_add_array(table, name, value, variable->dims[0], variable->dims[1], false);
        }
        if (value != NULL) {
            free(value);
            return;
        }
    }
    table_note(table, "%s is no array of real numbers", name);
}

bool table_read_matlab(table_t *table, const char *path, failure_t *failure) {
    mat_t *file = Mat_Open(path, MAT_ACC_RDONLY);
    matvar_t *variable;
    if (file == NULL) {
        return fail(failure, "%s: a MATLAB file that cannot be read: is it whole?", path);
    }
    table_open(table, path, "MATLAB 5");
    while ((variable = Mat_VarReadNext(file)) != NULL) {
        if (variable->name != NULL && variable->name[0] != '#') {
            take(table, variable, variable->name, 0);
        }
        Mat_VarFree(variable);
    }
    Mat_Close(file);
    if (table->columns == 0) {
        fail(failure, "%s: no variable in it is a signal (a vector or matrix of real numbers)", path);
        table_free(table);
        return false;
    }
    return true;
}
