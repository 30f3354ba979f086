/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/folder.h"
#include "base/json_output.h"
#include "chain/chain.h"
#include "recording/recording.h"
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

/* Numbers behind the name of a file, until there is a free one. */
#define MOST_NUMBER 10000
/* Of a name that the user gives, without ending and number. */
#define LONGEST_STEM 100
/* A model says what it is near its beginning. */
#define BEGINNING 4096

static bool is_letter_or_digit(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

static bool is_name(const char *name) {
    if (!is_letter_or_digit(name[0])) {
        return false;
    }
    for (const char *c = name; *c != '\0'; c++) {
        if (!is_letter_or_digit(*c) && strchr("-_.", *c) == NULL) {
            return false;
        }
    }
    return true;
}

bool folder_path(const char *folder, const char *name, char path[FOLDER_PATH], failure_t *failure) {
    if (!is_name(name)) {
        return fail(failure,
                    "'%.100s': a name has letters, digits, '-', '_' and '.' only, and begins with one of the "
                    "first two",
                    name);
    }
    const bool here = strcmp(folder, ".") == 0; /* by its name alone, as people call it */
    const int length = snprintf(path, FOLDER_PATH, "%s%s%s", here ? "" : folder, here ? "" : "/", name);
    return (length > 0 && length < FOLDER_PATH) || fail(failure, "%s: name too long", name);
}

/* What the end of a name says. Recordings are files that say themselves what their columns are. */
typedef struct {
    const char *text, *type;
    file_kind_t kind;
} ending_t;

static const char binary[] = "application/octet-stream";
static const ending_t endings[] = {
    {".csv", "text/csv", FILE_RECORDING_KIND},
    {".h5", binary, FILE_RECORDING_KIND},
    {".hdf5", binary, FILE_RECORDING_KIND},
    {".mat", binary, FILE_RECORDING_KIND},
    {".npz", binary, FILE_RECORDING_KIND},
    {".lvm", binary, FILE_RECORDING_KIND},
    {".txt", "text/plain", FILE_MEASUREMENTS_KIND},
    {".tsv", "text/plain", FILE_MEASUREMENTS_KIND},
    {".dat", "text/plain", FILE_MEASUREMENTS_KIND},
    {".asc", "text/plain", FILE_MEASUREMENTS_KIND},
    {".itx", "text/plain", FILE_MEASUREMENTS_KIND},
    {".npy", binary, FILE_MEASUREMENTS_KIND},
    {".gz", binary, FILE_MEASUREMENTS_KIND},
    {".json", "application/json", FILE_MODEL_KIND},
    {".image", binary, FILE_IMAGE_KIND},
    {".html", "text/html; charset=utf-8", FILE_REPORT_KIND},
};

/* In any case: oscilloscopes write SCOPE.CSV. NULL: none of them. */
static const ending_t *ending_before(const char *name, size_t length) {
    for (size_t i = 0; i < sizeof endings / sizeof endings[0]; i++) {
        const size_t end = strlen(endings[i].text);
        if (length > end && strncasecmp(name + length - end, endings[i].text, end) == 0) {
            return &endings[i];
        }
    }
    return NULL;
}

static const ending_t *ending_of(const char *name) {
    return ending_before(name, strlen(name));
}

static bool is_model(const char *path) {
    char text[BEGINNING + 1];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return false;
    }
    text[fread(text, 1, BEGINNING, file)] = '\0';
    (void)fclose(file);
    return strstr(text, "\"hyst-model-1\"") != NULL;
}

file_kind_t folder_kind(const char *folder, const char *name) {
    char path[FOLDER_PATH];
    failure_t ignored;
    struct stat status;
    if (!folder_path(folder, name, path, &ignored) || stat(path, &status) != 0 || !S_ISREG(status.st_mode)) {
        return FILE_OTHER;
    }
    return folder_holds(name, path) ? ending_of(name)->kind : FILE_OTHER;
}

bool folder_holds(const char *name, const char *path) {
    const ending_t *const ending = ending_of(name);
    return ending != NULL && (ending->kind != FILE_MODEL_KIND || is_model(path));
}

const char *folder_type(const char *name) {
    const ending_t *const ending = ending_of(name);
    return ending != NULL ? ending->type : binary;
}

static const char *const kind_names[] = {"file", "recording", "model", "image", "report", "measurements"};

bool folder_file(const char *folder, const char *name, file_kind_t kind, char path[FOLDER_PATH], failure_t *failure) {
    return folder_path(folder, name, path, failure) &&
           (folder_kind(folder, name) == kind || fail(failure, "%s: no such %s in the folder", name, kind_names[kind]));
}

typedef struct {
    json_t *entry;
    double changed;
} listed_t;

static int newest_first(const void *left, const void *right) {
    const double a = ((const listed_t *)left)->changed;
    const double b = ((const listed_t *)right)->changed;
    return (a < b) - (a > b);
}

json_t *folder_list(const char *folder, failure_t *failure) {
    DIR *opened = opendir(folder);
    if (opened == NULL) {
        (void)fail(failure, "%s: %s", folder, strerror(errno));
        return NULL;
    }
    listed_t *listed = NULL;
    size_t count = 0;
    for (const struct dirent *entry; (entry = readdir(opened)) != NULL;) {
        char path[FOLDER_PATH];
        struct stat status;
        failure_t ignored;
        const file_kind_t kind = folder_kind(folder, entry->d_name);
        if (kind == FILE_OTHER || !folder_path(folder, entry->d_name, path, &ignored) || stat(path, &status) != 0) {
            continue;
        }
        listed = reallocate(listed, count + 1, sizeof *listed);
        const double changed = (double)status.st_mtim.tv_sec + 1e-9 * (double)status.st_mtim.tv_nsec;
        listed[count++] = (listed_t){json_pack("{s:s, s:s, s:I, s:f}", "name", entry->d_name, "kind", kind_names[kind],
                                               "bytes", (json_int_t)status.st_size, "changed", changed),
                                     changed};
    }
    (void)closedir(opened);
    if (count > 0) {
        qsort(listed, count, sizeof *listed, newest_first);
    }
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(list, listed[i].entry);
    }
    free(listed);
    return list;
}

static json_t *column_json(const double *values, size_t samples, size_t step) {
    json_t *array = json_array();
    for (size_t i = 0; i < samples; i += step) {
        json_array_append_new(array, json_number_or_null(round(values[i] * 1e5) / 1e5));
    }
    return array;
}

json_t *folder_recording(const char *folder, const char *name, size_t most, failure_t *failure) {
    char path[FOLDER_PATH];
    recording_t r;
    if (!folder_file(folder, name, FILE_RECORDING_KIND, path, failure) || !recording_read(&r, path, failure)) {
        return NULL;
    }
    const size_t step = (r.samples + most - 1) / most;
    json_t *json = json_pack("{s:s, s:I, s:f, s:f, s:I}", "name", name, "samples", (json_int_t)r.samples,
                             "sample_rate_hz", r.sample_rate_hz, "start_s", r.start_s, "step", (json_int_t)step);
    static const column_t shown[] = {COLUMN_DRIVE, COLUMN_DISPLACEMENT, COLUMN_REFERENCE};
    for (size_t i = 0; i < sizeof shown / sizeof shown[0]; i++) {
        if (r.column[shown[i]] != NULL) {
            json_object_set_new(json, column_name(shown[i]), column_json(r.column[shown[i]], r.samples, step));
        }
    }
    if (r.column[COLUMN_REFERENCE] != NULL) {
        const error_measure_t error =
            measure_error(r.column[COLUMN_REFERENCE], r.column[COLUMN_DISPLACEMENT], r.samples);
        json_object_set_new(json, "max_error_um", json_real(error.max_um));
        json_object_set_new(json, "rms_error_um", json_real(error.rms_um));
        json_object_set_new(json, "nrmse_percent", json_number_or_null(error.nrmse_percent));
    }
    recording_free(&r);
    return json;
}

static bool is_free(const char *folder, const char *name, char path[FOLDER_PATH], failure_t *failure) {
    return folder_path(folder, name, path, failure) && (access(path, F_OK) != 0 || fail(failure, "%s exists", name));
}

bool folder_free_names(const char *folder, const char *stem, const char *const suffix[], size_t count,
                       char name[][FOLDER_NAME], failure_t *failure) {
    char path[FOLDER_PATH];
    if (strlen(stem) > LONGEST_STEM || !folder_path(folder, stem, path, failure)) {
        return fail(failure, "'%.100s': a name has at most %d letters, digits, '-', '_' and '.'", stem, LONGEST_STEM);
    }
    for (int number = 1; number < MOST_NUMBER; number++) {
        bool all = true;
        for (size_t i = 0; all && i < count; i++) {
            (void)(number == 1 ? snprintf(name[i], FOLDER_NAME, "%s%s", stem, suffix[i])
                               : snprintf(name[i], FOLDER_NAME, "%s-%d%s", stem, number, suffix[i]));
            all = is_free(folder, name[i], path, failure);
        }
        if (all) {
            return true;
        }
    }
    return fail(failure, "%s: all numbers behind this name are taken", stem);
}

/* Of the first `length` characters. "Messung 3 (neu)" is "Messung_3_neu_", and "-o" is "file-o". */
static void make_stem(const char *wished, size_t length, char stem[LONGEST_STEM + 1]) {
    size_t made = 0;
    if (!is_letter_or_digit(wished[0])) {
        made = (size_t)snprintf(stem, LONGEST_STEM, "file");
    }
    for (size_t i = 0; i < length && made < LONGEST_STEM; i++) {
        const bool plain = is_letter_or_digit(wished[i]) || strchr("-_.", wished[i]) != NULL;
        if (plain || stem[made - 1] != '_') {
            stem[made++] = plain ? wished[i] : '_';
        }
    }
    stem[made] = '\0';
}

bool folder_name_for(const char *folder, const char *wished, char name[1][FOLDER_NAME], failure_t *failure) {
    const ending_t *ending = ending_of(wished);
    if (ending == NULL || ending->kind == FILE_REPORT_KIND) {
        return fail(failure,
                    "'%.100s': its ending is of no recording, measurements, model or image. Recordings and "
                    "measurements are .csv, .txt, .tsv, .dat, .asc, .itx, .lvm, .mat, .h5, .hdf5, .npy, .npz and .gz",
                    wished);
    }
    size_t cut = strlen(wished);
    for (int many = 0; ending != NULL && many < 2; many++, ending = ending_before(wished, cut)) { /* scope.csv.gz */
        cut -= strlen(ending->text);
    }
    char stem[LONGEST_STEM + 1];
    const char *const suffix[] = {wished + cut};
    make_stem(wished, cut, stem);
    return folder_free_names(folder, stem, suffix, 1, name, failure);
}
