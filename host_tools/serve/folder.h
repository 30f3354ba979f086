/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The folder that the page works in: recordings, models, images and reports by name. Nothing outside of it. */
#ifndef FOLDER_H
#define FOLDER_H

#include "base/failure.h"
#include <jansson.h>

/** Length of a path in bytes, with its end. */
#define FOLDER_PATH 4096
/** And of a name in the folder. */
#define FOLDER_NAME 256

/** Measurements: what is imported before it is a recording that the page uses. */
typedef enum {
    FILE_OTHER,
    FILE_RECORDING_KIND,
    FILE_MODEL_KIND,
    FILE_IMAGE_KIND,
    FILE_REPORT_KIND,
    FILE_MEASUREMENTS_KIND
} file_kind_t;

/** The path of a file in the folder. Refuses a name that is not one of letters, digits, '-', '_' and '.', that begins
 * with another than a letter or a digit, or that is too long. */
bool folder_path(const char *folder, const char *name, char path[FOLDER_PATH], failure_t *failure);

/** What the name and, for JSON, the beginning of the file say. */
file_kind_t folder_kind(const char *folder, const char *name);

/** Whether it is of a kind that the page works with, by its name and, for JSON, what the file at `path` says. */
bool folder_holds(const char *name, const char *path);

/** The media type of a file of this name. */
const char *folder_type(const char *name);

/** Of an existing file that has this kind. */
bool folder_file(const char *folder, const char *name, file_kind_t kind, char path[FOLDER_PATH], failure_t *failure);

/** "STEM.csv", or "STEM-2.csv" and so on: the first with which the names with all `count` suffixes are free. */
bool folder_free_names(const char *folder, const char *stem, const char *const suffix[], size_t count,
                       char name[][FOLDER_NAME], failure_t *failure);

/** A free name for a file that is called `wished` elsewhere: other characters than those of a name become '_', a number
 * comes before the ending if the name is taken. Refuses an ending that is of no recording, measurements, model or
 * image.
 */
bool folder_name_for(const char *folder, const char *wished, char name[1][FOLDER_NAME], failure_t *failure);

/** [{"name":, "kind": "recording"|"model"|"image"|"report"|"measurements", "bytes":, "changed":}], newest first. */
json_t *folder_list(const char *folder, failure_t *failure);

/** A recording for a plot: {"name":, "samples":, "sample_rate_hz":, "start_s":, "step":, "drive": [..], ..}. Of every
 * `step` samples it holds the first; step is the smallest with which there are at most `most` of them. With a reference
 * also what its error is: {"max_error_um":, "rms_error_um":, "nrmse_percent":}, of all samples. */
json_t *folder_recording(const char *folder, const char *name, size_t most, failure_t *failure);

#endif
