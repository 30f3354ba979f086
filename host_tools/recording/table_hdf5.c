/* SPDX-License-Identifier: GPL-3.0-or-later */
/* HDF5, which MATLAB 7.3 files are, too: every data set of numbers with one or two dimensions. */
#define H5_USE_110_API /* the interface that Debian 12 has; later ones keep it */
#include "recording/table.h"
#include <hdf5.h>
#include <stdlib.h>
#include <string.h>

/* A text attribute of a data set: fixed or variable length. "" if there is none. */
static void read_text_attribute(hid_t object, const char *name, char *text, size_t room) {
    hid_t attribute, type, space;
    text[0] = '\0';
    if (H5Aexists(object, name) <= 0) {
        return;
    }
    attribute = H5Aopen(object, name, H5P_DEFAULT);
    type = H5Aget_type(attribute);
    space = H5Aget_space(attribute);
    if (H5Tget_class(type) == H5T_STRING && H5Sget_simple_extent_npoints(space) == 1) {
        hid_t memory = H5Tcopy(H5T_C_S1);
        H5Tset_cset(memory, H5Tget_cset(type));
        if (H5Tis_variable_str(type) > 0) {
            char *pointer = NULL;
            H5Tset_size(memory, H5T_VARIABLE);
            if (H5Aread(attribute, memory, (void *)&pointer) >= 0 && pointer != NULL) {
                strncat(text, pointer, room - 1);
                H5free_memory(pointer);
            }
        } else {
            H5Tset_size(memory, room);
            if (H5Aread(attribute, memory, text) < 0) {
                text[0] = '\0';
            }
            text[room - 1] = '\0';
        }
        H5Tclose(memory);
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(attribute);
}

static void read_rate(table_t *table, hid_t object) {
    static const struct {
        const char *name;
        bool rate;
    } attributes[] = {{"sample_rate_hz", true}, {"sample_rate", true}, {"fs", true}, {"rate", true}, {"dt", false}};
    for (size_t i = 0; i < sizeof attributes / sizeof attributes[0]; i++) {
        double number = 0.0;
        if (H5Aexists(object, attributes[i].name) > 0) {
            hid_t attribute = H5Aopen(object, attributes[i].name, H5P_DEFAULT), space = H5Aget_space(attribute);
            if (H5Sget_simple_extent_npoints(space) == 1 && H5Aread(attribute, H5T_NATIVE_DOUBLE, &number) >= 0 &&
                number > 0.0) {
                table_set_interval(table, attributes[i].rate ? 1.0 / number : number, attributes[i].name);
            }
            H5Sclose(space);
            H5Aclose(attribute);
        }
    }
}

static void take(table_t *table, hid_t set, const char *name) {
    hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    const int rank = H5Sget_simple_extent_ndims(space);
    const H5T_class_t class = H5Tget_class(type);
    hsize_t dims[2] = {1, 1};
    if ((class == H5T_FLOAT || class == H5T_INTEGER) && rank <= 2) {
        H5Sget_simple_extent_dims(space, dims, NULL);
        if (dims[0] > 0 && dims[1] > 0 && dims[0] * dims[1] <= (hsize_t)1 << 32) {
            const size_t before = table->columns;
            double *value = allocate((size_t)(dims[0] * dims[1]), sizeof *value);
            if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0) {
                char unit[64];
                table_add_array(table, name, value, (size_t)dims[0], (size_t)dims[1], true);
                read_text_attribute(set, "units", unit, sizeof unit);
                if (unit[0] == '\0') {
                    read_text_attribute(set, "unit", unit, sizeof unit);
                }
                for (size_t i = before < table->columns ? before : 0; unit[0] != '\0' && i < table->columns; i++) {
                    if (strncmp(table->column[i].written, name, strlen(name)) == 0) {
                        free(table->column[i].unit);
                        table->column[i].unit = copy_text(unit);
                    }
                }
                read_rate(table, set);
            } else {
                table_note(table, "%s cannot be read", name);
            }
            free(value);
        }
    } else {
        table_note(table, "%s is no array of real numbers", name);
    }
    H5Sclose(space);
    H5Tclose(type);
}

static herr_t visit(hid_t file, const char *name, const H5O_info_t *info, void *context) {
    if (strncmp(name, "#refs#", 6) == 0) { /* what MATLAB 7.3 keeps of cells */
        return 0;
    }
    if (info->type == H5O_TYPE_DATASET) {
        hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
        if (set >= 0) {
            take(context, set, name);
            H5Dclose(set);
        }
    } else if (info->type == H5O_TYPE_GROUP) {
        hid_t group = H5Oopen(file, name, H5P_DEFAULT);
        if (group >= 0) {
            read_rate(context, group);
            H5Oclose(group);
        }
    }
    return 0;
}

bool table_read_hdf5(table_t *table, const char *path, failure_t *failure) {
    hid_t file;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* it would print */
    file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) {
        return fail(failure, "%s: an HDF5 file that cannot be read: is it whole, and closed by who writes it?", path);
    }
    table_open(table, path, "HDF5");
    H5Ovisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, visit, table);
    H5Fclose(file);
    if (table->columns == 0) {
        fail(failure, "%s: no data set in it is a signal (one or two dimensions of real numbers)", path);
        table_free(table);
        return false;
    }
    return true;
}
