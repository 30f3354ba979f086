/* SPDX-License-Identifier: GPL-3.0-or-later */
/* HDF5, which MATLAB 7.3 files are, too: every data set of numbers with one or two dimensions. */
#define H5_USE_110_API /* the interface that Debian 12 has; later ones keep it */
#include "recording/table/hdf5_text.h"
#include "recording/table/table.h"
#include "recording/table/units.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A number that is an attribute; false: there is none. */
static bool read_number(hid_t object, const char *name, double *number) {
    bool good = false;
    if (H5Aexists(object, name) > 0) {
        const hid_t attribute = H5Aopen(object, name, H5P_DEFAULT), space = H5Aget_space(attribute);
        good = H5Sget_simple_extent_npoints(space) == 1 && H5Aread(attribute, H5T_NATIVE_DOUBLE, number) >= 0;
        H5Sclose(space);
        H5Aclose(attribute);
    }
    return good;
}

static void read_rate(table_t *table, hid_t object) {
    static const struct {
        const char *name;
        bool rate;
    } attributes[] = {{"sample_rate_hz", true}, {"sample_rate", true}, {"fs", true}, {"rate", true}, {"dt", false}};
    for (size_t i = 0; i < sizeof attributes / sizeof attributes[0]; i++) {
        double number = 0.0;
        if (read_number(object, attributes[i].name, &number) && number > 0.0) {
            table_set_interval(table, attributes[i].rate ? 1.0 / number : number, attributes[i].name);
        }
    }
}

/* What attributes of a data set say of a column, if it is the data set's. A long name is that of one signal. */
static void take_texts(table_column_t *column, const char *name, const char *unit, const char *origin) {
    if (strncmp(column->written, name, strlen(name)) != 0) {
        return;
    }
    double scale;
    if (unit[0] != '\0') {
        if (unit_of(column->unit, &scale) == QUANTITY_UNKNOWN && strcmp(column->unit, unit) != 0) {
            /* "height (measured)" */
            free(column->name);
            column->name = copy_text(column->written);
        }
        free(column->unit);
        column->unit = copy_text(unit);
    }
    if (origin[0] != '\0' && strcmp(column->written, name) == 0) {
        free(column->origin);
        column->origin = copy_text(origin);
    }
}

/* MATLAB 7.3 writes as numbers, too: texts, objects of its classes, and the size of what is empty. */
static bool is_matlab_number(hid_t set) {
    char class[20];
    hdf5_read_text(set, "MATLAB_class", class, sizeof class);
    return strcmp(class, "char") != 0 && H5Aexists(set, "MATLAB_object_decode") <= 0 &&
           H5Aexists(set, "MATLAB_empty") <= 0;
}

enum { MOST_DIMENSIONS = 8 };

/* The size of a data set without dimensions of one element; false: more than two are left, or nothing is. */
static bool get_size(hid_t space, hsize_t size[2]) {
    hsize_t all[MOST_DIMENSIONS];
    const int rank = H5Sget_simple_extent_ndims(space);
    int kept = 0;
    size[0] = size[1] = 1;
    if (rank < 0 || rank > MOST_DIMENSIONS) {
        return false;
    }
    H5Sget_simple_extent_dims(space, all, NULL);
    for (int i = 0; i < rank; i++) {
        if (all[i] != 1 && kept++ < 2) {
            size[kept - 1] = all[i];
        }
    }
    return kept <= 2 && size[0] > 0 && size[1] > 0 && size[0] * size[1] <= (hsize_t)1 << 32;
}

/* Whether an attribute says that the numbers are multiplied by something, but not that this is still to be done. */
static bool has_factor(hid_t set) {
    static const char *const names[] = {"scale", "Scale", "gain", "Gain", "factor", "sensitivity", "calibration"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        double factor;
        if (read_number(set, names[i], &factor) && factor != 1.0) {
            return true;
        }
    }
    return false;
}

/* Numbers that are packed as the conventions of climate and forecast say, as netCDF writes them. */
static void unpack(hid_t set, double *value, size_t count) {
    double factor = 1.0, offset = 0.0, none;
    const bool packed = read_number(set, "scale_factor", &factor) || H5Aexists(set, "add_offset") > 0,
               holes = read_number(set, "_FillValue", &none);
    (void)read_number(set, "add_offset", &offset);
    for (size_t i = 0; (packed || holes) && i < count; i++) {
        value[i] = holes && value[i] == none ? (double)NAN : factor * value[i] + offset;
    }
}

/* The texts of the first of these attributes that has one for each column; NULL: none has. To be freed. */
static char *texts_of_columns(hid_t set, const char *const *attribute, size_t attributes, size_t columns) {
    char *const text = allocate(columns, HDF5_TEXT);
    for (size_t i = 0; columns > 1 && i < attributes; i++) {
        if (hdf5_read_texts(set, attribute[i], text, HDF5_TEXT, columns) == columns) {
            return text;
        }
    }
    free(text);
    return NULL;
}

/* Names and units of the columns of a data set of several, in lists ("columns": time, displacement, drive). */
static void name_columns(table_column_t *column, size_t columns, hid_t set, const char *path) {
    static const char *const of_names[] = {"columns", "column_names", "names",  "fields",        "labels",
                                           "signals", "channels",     "Labels", "channel_names", "Columns"},
                             *const of_units[] = {"units", "unit", "Units", "Unit", "column_units"};
    char *const names = texts_of_columns(set, of_names, sizeof of_names / sizeof of_names[0], columns);
    char *const units = texts_of_columns(set, of_units, sizeof of_units / sizeof of_units[0], columns);
    for (size_t i = 0; i < columns; i++) {
        char name[UNIT_FIELD], unit[UNIT_FIELD] = "", text[2 * HDF5_TEXT];
        if (names != NULL && snprintf(name, sizeof name, "%s", names + i * HDF5_TEXT) < (int)sizeof name) {
            (void)snprintf(text, sizeof text, "%.300s/%.400s", path, name);
            free(column[i].written);
            column[i].written = copy_text(text);
            unit_split(name, unit, "/_ ,:");
            (void)snprintf(text, sizeof text, "%.300s/%.400s", path, name[0] != '\0' ? name : names + i * HDF5_TEXT);
            free(column[i].name);
            column[i].name = copy_text(text);
        }
        if (unit[0] != '\0' || units != NULL) {
            free(column[i].unit);
            column[i].unit = copy_text(units != NULL ? units + i * HDF5_TEXT : unit);
        }
    }
    free(names);
    free(units);
}

/* Attributes: the unit, and the name of one signal. */
static void take_attributes(table_t *table, hid_t set, const char *name, size_t before) {
    static const char *const units[] = {"units", "unit", "Units", "Unit"};
    char unit[64] = "", origin[HDF5_TEXT];
    for (size_t i = 0; i < sizeof units / sizeof units[0] && unit[0] == '\0'; i++) {
        hdf5_read_text(set, units[i], unit, sizeof unit);
    }
    char *const since = strstr(unit, " since "); /* "milliseconds since 2026-11-30", of netCDF */
    if (since != NULL) {
        *since = '\0';
    }
    hdf5_read_text(set, "long_name", origin, sizeof origin);
    const bool scaled = has_factor(set);
    for (size_t i = before; i < table->columns; i++) {
        take_texts(&table->column[i], name, unit, origin);
        table->column[i].scaled =
            table->column[i].scaled || (scaled && strncmp(table->column[i].written, name, strlen(name)) == 0);
    }
    if (before < table->columns) {
        name_columns(&table->column[before], table->columns - before, set, name);
    }
    read_rate(table, set);
}

/* Why the numbers of a data set cannot be read, where it is packed in a way that needs a plugin of HDF5; else "". */
static void missing_filter(hid_t set, char *text, size_t room) {
    const hid_t list = H5Dget_create_plist(set);
    const int filters = H5Pget_nfilters(list);
    text[0] = '\0';
    for (int i = 0; i < filters; i++) {
        char name[40] = "";
        unsigned flags;
        size_t none = 0;
        const H5Z_filter_t filter = H5Pget_filter2(list, (unsigned)i, &flags, &none, NULL, sizeof name, name, NULL);
        if (filter >= 0 && H5Zfilter_avail(filter) <= 0) {
            (void)snprintf(text, room, ": it is packed by %.40s (filter %d), unpack it (h5repack -f NONE)",
                           name[0] != '\0' ? name : "another program", (int)filter);
        }
    }
    H5Pclose(list);
}

static void take_numbers(table_t *table, hid_t set, const char *name, const hsize_t size[2]) {
    const size_t columns = table->columns, rows = table->rows;
    double *value = allocate((size_t)(size[0] * size[1]), sizeof *value);
    if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0) {
        unpack(set, value, (size_t)(size[0] * size[1]));
        table_add_array(table, name, value, (size_t)size[0], (size_t)size[1], true);
        take_attributes(table, set, name, table->rows == rows ? columns : 0); /* longer ones take the others' place */
    } else {
        char packed[140];
        missing_filter(set, packed, sizeof packed);
        table_note(table, "%s cannot be read%s", name, packed);
    }
    free(value);
}

/* Two parts of one number, as h5py and MATLAB write complex ones: a field alone is not the signal. */
static bool is_complex(hid_t type) {
    static const char *const parts[][2] = {{"r", "i"}, {"real", "imag"}};
    bool found = false;
    for (size_t i = 0; H5Tget_nmembers(type) == 2 && i < sizeof parts / sizeof parts[0]; i++) {
        found = found || (H5Tget_member_index(type, parts[i][0]) == 0 && H5Tget_member_index(type, parts[i][1]) == 1);
    }
    return found;
}

/* One field of all elements of a data set of structures, as NumPy and pandas write tables. */
static void take_field(table_t *table, hid_t set, hid_t type, unsigned field, size_t rows) {
    char *const name = H5Tget_member_name(type, field);
    const H5T_class_t class = H5Tget_member_class(type, field);
    const hid_t memory = H5Tcreate(H5T_COMPOUND, sizeof(double));
    double *value = allocate(rows, sizeof *value);
    if ((class == H5T_FLOAT || class == H5T_INTEGER) && name != NULL &&
        H5Tinsert(memory, name, 0, H5T_NATIVE_DOUBLE) >= 0 &&
        H5Dread(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0) {
        table_add_array(table, name, value, rows, 1, true);
    } else {
        table_note(table, "%s is no array of real numbers", name != NULL ? name : "a field");
    }
    free(value);
    H5Tclose(memory);
    H5free_memory(name);
}

static void take(table_t *table, hid_t set, const char *name) {
    hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    const H5T_class_t class = H5Tget_class(type);
    hsize_t size[2];
    const bool sized = get_size(space, size);
    if ((class == H5T_FLOAT || class == H5T_INTEGER) && sized && is_matlab_number(set)) {
        take_numbers(table, set, name, size);
    } else if (class == H5T_COMPOUND && is_complex(type)) {
        table_note(table, "%s " TABLE_COMPLEX, name);
    } else if (class == H5T_COMPOUND && sized && size[1] == 1) {
        for (int i = 0; i < H5Tget_nmembers(type); i++) {
            take_field(table, set, type, (unsigned)i, (size_t)size[0]);
        }
        read_rate(table, set);
    } else {
        table_note(table, "%s is no array of real numbers%s", name, sized ? "" : " with one or two dimensions");
    }
    H5Sclose(space);
    H5Tclose(type);
}

typedef struct {
    table_t *table;
    size_t objects; /* of MATLAB */
} visit_t;

static herr_t visit(hid_t file, const char *name, const H5O_info_t *info, void *context) {
    visit_t *const v = context;
    /* what MATLAB 7.3 keeps of cells and of objects */
    if (strncmp(name, "#refs#", 6) == 0 || strncmp(name, "#subsystem#", 11) == 0) {
        return 0;
    }
    if (info->type == H5O_TYPE_DATASET) {
        hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
        if (set >= 0) {
            v->objects += H5Aexists(set, "MATLAB_object_decode") > 0 ? 1 : 0;
            take(v->table, set, name);
            H5Dclose(set);
        }
    } else if (info->type == H5O_TYPE_GROUP) {
        hid_t group = H5Oopen(file, name, H5P_DEFAULT);
        if (group >= 0) {
            read_rate(v->table, group);
            H5Oclose(group);
        }
    }
    return 0;
}

bool table_read_hdf5(table_t *table, const char *path, failure_t *failure) {
    visit_t context = {.table = table};
    hid_t file;
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* it would print */
    file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) {
        return fail(failure, "%s: an HDF5 file that cannot be read: is it whole, and closed by who writes it?", path);
    }
    table_open(table, path, "HDF5");
    H5Ovisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, visit, &context);
    H5Fclose(file);
    if (table->columns == 0) {
        fail(failure, "%s: no data set in it is a signal (one or two dimensions of real numbers)%s%s%s", path,
             table->notes > 0 && context.objects == 0 ? ": " : "",
             table->notes > 0 && context.objects == 0 ? table->note[0] : "", context.objects > 0 ? MATLAB_OBJECTS : "");
        table_free(table);
        return false;
    }
    return true;
}
