/* SPDX-License-Identifier: GPL-3.0-or-later */
#define H5_USE_110_API /* the interface that Debian 12 has; later ones keep it */
#include "recording/recording_hdf5.h"
#include "base/file_ending.h"
#include "base/output_file.h"
#include "base/provenance.h"
#include "base/shown_name.h"
#include "recording/table/hdf5_text.h"
#include <hdf5.h>
#include <hdf5_hl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FORMAT "hyst-recording-1"

enum { MOST_KEY = 1000 };

/* Attributes of / that are no header keys. */
static const char *const reserved[] = {"format",       "sample_rate_hz", "start_s",      "Conventions",   "history",
                                       "source_files", "device",         "hyst_version", "_NCProperties", NULL};

bool hdf5_is_named(const char *path) {
    static const char *const endings[] = {".h5", ".hdf5", ".nc", NULL};
    return file_ending(path, endings) != NULL;
}

static bool is_reserved(const char *name) {
    size_t i = 0;
    while (reserved[i] != NULL && strcmp(reserved[i], name) != 0) {
        i++;
    }
    return reserved[i] != NULL;
}

static bool put_text(hid_t object, const char *name, const char *text) {
    const size_t length = strlen(text);
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_cset(type, H5T_CSET_UTF8);
    H5Tset_size(type, length > 0 ? length : 1);
    const hid_t attribute = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    const bool good = attribute >= 0 && H5Awrite(attribute, type, text) >= 0;
    if (attribute >= 0) {
        H5Aclose(attribute);
    }
    H5Sclose(space);
    H5Tclose(type);
    return good;
}

static bool put_number(hid_t object, const char *name, double number) {
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t attribute = H5Acreate2(object, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT);
    const bool good = attribute >= 0 && H5Awrite(attribute, H5T_NATIVE_DOUBLE, &number) >= 0;
    if (attribute >= 0) {
        H5Aclose(attribute);
    }
    H5Sclose(space);
    return good;
}

/* A data set of / with one value a sample, and its unit if that is known; to be closed. Negative: failed. */
static hid_t put_column(hid_t file, const char *name, const char *unit, const double *value, size_t samples) {
    const hsize_t length = samples;
    const hid_t space = H5Screate_simple(1, &length, NULL), plan = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_fill_time(plan, H5D_FILL_TIME_NEVER);
    hid_t set = H5Dcreate2(file, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, plan, H5P_DEFAULT);
    if (set >= 0 && (H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) < 0 ||
                     (unit[0] != '\0' && !put_text(set, "units", unit)))) {
        H5Dclose(set);
        set = -1;
    }
    H5Pclose(plan);
    H5Sclose(space);
    return set;
}

static bool put_extra(hid_t file, hid_t time, const recording_extra_t *extra, size_t samples) {
    const hid_t set = put_column(file, extra->name, extra->unit, extra->value, samples);
    const bool good = set >= 0 && H5DSattach_scale(set, time, 0) >= 0 &&
                      (extra->long_name[0] == '\0' || put_text(set, "long_name", extra->long_name));
    if (set >= 0) {
        H5Dclose(set);
    }
    return good;
}

static bool put_origin(hid_t root) {
    provenance_t from;
    provenance_now(&from);
    size_t room = 1;
    for (size_t i = 0; i < from.files; i++) {
        room += sizeof from.file[i].sha256 + strlen(shown_name(from.file[i].path)) + 3;
    }
    char *files = allocate(room, 1), history[2048];
    for (size_t i = 0, at = 0; i < from.files; i++) {
        at += (size_t)snprintf(files + at, room - at, "%s%s  %s", i > 0 ? "\n" : "", from.file[i].sha256,
                               shown_name(from.file[i].path));
    }
    snprintf(history, sizeof history, "%s: %s", from.date, from.command != NULL ? from.command : "the library of hyst");
    const bool good = put_text(root, "Conventions", "CF-1.8") && put_text(root, "hyst_version", HYST_VERSION) &&
                      put_text(root, "history", history) &&
                      (from.files == 0 || put_text(root, "source_files", files)) &&
                      (from.device == NULL || put_text(root, "device", from.device));
    free(files);
    provenance_free(&from);
    return good;
}

static bool put_all(hid_t file, const recording_t *recording) {
    bool good = put_text(file, "format", FORMAT) && put_number(file, "sample_rate_hz", recording->sample_rate_hz) &&
                put_number(file, "start_s", recording->start_s) && put_origin(file);
    for (size_t i = 0; good && i < recording->keys; i++) {
        good = is_reserved(recording->key[i].key) || put_text(file, recording->key[i].key, recording->key[i].value);
    }
    double *time_s = allocate(recording->samples, sizeof *time_s);
    for (size_t k = 0; k < recording->samples; k++) {
        time_s[k] = recording->start_s + (double)k / recording->sample_rate_hz;
    }
    const hid_t time = good ? put_column(file, "time", "s", time_s, recording->samples) : -1;
    free(time_s);
    good = time >= 0 && H5DSset_scale(time, "time") >= 0;
    for (column_t c = 0; good && c < COLUMN_COUNT; c++) {
        if (recording->column[c] != NULL) {
            const hid_t set =
                put_column(file, column_name(c), column_unit(c), recording->column[c], recording->samples);
            good = set >= 0 && H5DSattach_scale(set, time, 0) >= 0;
            if (set >= 0) {
                H5Dclose(set);
            }
        }
    }
    for (size_t i = 0; good && i < recording->extras; i++) {
        good = put_extra(file, time, &recording->extra[i], recording->samples);
    }
    if (time >= 0) {
        H5Dclose(time);
    }
    return good;
}

bool hdf5_write_recording(const recording_t *recording, const char *path, failure_t *failure) {
    output_file_t output;
    if (!output_file_open(&output, path, failure)) {
        return false;
    }
    if (output.part == NULL) {
        return output_file_close(&output, fail(failure, "%s: HDF5 is not written into a stream: name a file", path),
                                 failure);
    }
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* it would print */
    const hid_t plan = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_attr_creation_order(plan, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
    H5Pset_link_creation_order(plan, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED); /* netCDF-4 writes so */
    const hid_t file = H5Fcreate(output.part, H5F_ACC_TRUNC, plan, H5P_DEFAULT);
    bool good = file >= 0 && put_all(file, recording);
    good = (file < 0 || H5Fclose(file) >= 0) && good;
    H5Pclose(plan);
    return output_file_close(&output, good || fail(failure, "%s: could not be written", path), failure);
}

/* A text attribute; false: there is none, or it is no text of this length. */
static bool get_text(hid_t attribute, char text[MOST_KEY + 1]) {
    const hid_t type = H5Aget_type(attribute);
    const size_t size = H5Tget_size(type);
    const bool good = H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0 && size <= MOST_KEY &&
                      H5Aread(attribute, type, text) >= 0;
    text[good ? size : 0] = '\0';
    H5Tclose(type);
    return good;
}

static bool get_number(hid_t file, const char *name, double *number) {
    bool good = false;
    if (H5Aexists(file, name) > 0) {
        const hid_t attribute = H5Aopen(file, name, H5P_DEFAULT), space = H5Aget_space(attribute);
        good = H5Sget_simple_extent_npoints(space) == 1 && H5Aread(attribute, H5T_NATIVE_DOUBLE, number) >= 0;
        H5Sclose(space);
        H5Aclose(attribute);
    }
    return good;
}

static herr_t get_key(hid_t file, const char *name, const H5A_info_t *info, void *context) {
    char text[MOST_KEY + 1];
    (void)info;
    if (!is_reserved(name) && !recording_is_unit_key(name)) {
        const hid_t attribute = H5Aopen(file, name, H5P_DEFAULT);
        if (attribute >= 0) {
            if (get_text(attribute, text)) {
                recording_set_key(context, name, text);
            }
            H5Aclose(attribute);
        }
    }
    return 0;
}

bool hdf5_is_recording(const char *path) {
    char text[MOST_KEY + 1] = "";
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    if (H5Fis_hdf5(path) <= 0) {
        return false;
    }
    const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file >= 0 && H5Aexists(file, "format") > 0) {
        const hid_t attribute = H5Aopen(file, "format", H5P_DEFAULT);
        if (!get_text(attribute, text)) {
            text[0] = '\0';
        }
        H5Aclose(attribute);
    }
    if (file >= 0) {
        H5Fclose(file);
    }
    return strcmp(text, FORMAT) == 0;
}

static bool check_values(const recording_t *recording, column_t c, failure_t *failure) {
    for (size_t k = 0; k < recording->samples; k++) {
        if (!(fabs(recording->column[c][k]) <= RECORDING_LARGEST)) {
            return fail(failure, "%s: sample %zu of %s is %g: a value beyond %g %s is a wrong unit, or no reading",
                        recording->name, k, column_name(c), recording->column[c][k], RECORDING_LARGEST, column_unit(c));
        }
    }
    return true;
}

/* A column, if the file has it. The first one that is read says how many samples there are. */
static bool get_column(hid_t file, column_t c, recording_t *recording, failure_t *failure) {
    if (H5Lexists(file, column_name(c), H5P_DEFAULT) <= 0) {
        return true;
    }
    const hid_t set = H5Dopen2(file, column_name(c), H5P_DEFAULT);
    if (set < 0) {
        return fail(failure, "%s: %s is no data set", recording->name, column_name(c));
    }
    const hid_t space = H5Dget_space(set);
    const hssize_t length = H5Sget_simple_extent_ndims(space) == 1 ? H5Sget_simple_extent_npoints(space) : -1;
    bool good = length >= 2 || fail(failure, "%s: %s has no two samples in a row", recording->name, column_name(c));
    if (good && recording->samples == 0) {
        recording->samples = (size_t)length;
    }
    good = good && ((size_t)length == recording->samples ||
                    fail(failure, "%s: %s has %lld samples, others have %zu", recording->name, column_name(c),
                         (long long)length, recording->samples));
    if (good) {
        good = H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, recording_add_column(recording, c)) >= 0
                   ? check_values(recording, c, failure)
                   : fail(failure, "%s: %s cannot be read", recording->name, column_name(c));
    }
    H5Sclose(space);
    H5Dclose(set);
    return good;
}

/* What the samples of a file are read into: a data set of one number a sample that is none of the known columns. */
static herr_t get_extra(hid_t file, const char *name, const H5L_info_t *info, void *context) {
    recording_t *recording = context;
    bool known = strcmp(name, "time") == 0;
    (void)info;
    for (column_t c = 0; c < COLUMN_COUNT; c++) {
        known = known || strcmp(name, column_name(c)) == 0;
    }
    const hid_t set = known ? -1 : H5Dopen2(file, name, H5P_DEFAULT);
    if (set < 0) {
        return 0; /* a group, or known */
    }
    const hid_t type = H5Dget_type(set), space = H5Dget_space(set);
    const H5T_class_t class = H5Tget_class(type);
    if ((class == H5T_FLOAT || class == H5T_INTEGER) && H5Sget_simple_extent_ndims(space) == 1 &&
        H5Sget_simple_extent_npoints(space) == (hssize_t)recording->samples && H5DSis_scale(set) <= 0) {
        double *value = allocate(recording->samples, sizeof *value);
        if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0) {
            char unit[HDF5_TEXT], long_name[HDF5_TEXT];
            hdf5_read_text(set, "units", unit, sizeof unit);
            hdf5_read_text(set, "long_name", long_name, sizeof long_name);
            recording_add_extra(recording, name, long_name, unit, value);
        }
        free(value);
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Dclose(set);
    return 0;
}

bool hdf5_read_recording(recording_t *recording, const char *path, failure_t *failure) {
    memset(recording, 0, sizeof *recording);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) {
        return fail(failure, "%s: an HDF5 file that cannot be read: is it whole, and closed by who writes it?", path);
    }
    recording->name = copy_text(shown_name(path));
    bool good = (get_number(file, "sample_rate_hz", &recording->sample_rate_hz) && recording->sample_rate_hz > 0.0 &&
                 recording->sample_rate_hz <= RECORDING_FASTEST_HZ &&
                 get_number(file, "start_s", &recording->start_s) && isfinite(recording->start_s)) ||
                fail(failure, "%s: attribute sample_rate_hz or start_s is missing, or no number that it can be", path);
    for (column_t c = 0; good && c < COLUMN_COUNT; c++) {
        good = get_column(file, c, recording, failure);
    }
    good = good && ((recording->column[COLUMN_DRIVE] != NULL && recording->column[COLUMN_DISPLACEMENT] != NULL) ||
                    fail(failure, "%s: no data set %s", path,
                         column_name(recording->column[COLUMN_DRIVE] == NULL ? COLUMN_DRIVE : COLUMN_DISPLACEMENT)));
    if (good) {
        hsize_t from = 0;
        if (H5Literate(file, H5_INDEX_CRT_ORDER, H5_ITER_INC, &from, get_extra, recording) < 0) {
            from = 0;
            H5Literate(file, H5_INDEX_NAME, H5_ITER_INC, &from, get_extra, recording);
        }
        from = 0;
        if (H5Aiterate2(file, H5_INDEX_CRT_ORDER, H5_ITER_INC, &from, get_key, recording) < 0) {
            from = 0; /* a file that another program has written anew has lost their order */
            H5Aiterate2(file, H5_INDEX_NAME, H5_ITER_INC, &from, get_key, recording);
        }
    }
    H5Fclose(file);
    if (!good) {
        recording_free(recording);
    }
    return good;
}
