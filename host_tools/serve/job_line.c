/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/job_line.h"
#include "serve/message.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void argue(job_line_t *line, const char *constant) {
    if (line->count + 1 < JOB_ARGUMENTS) {
        line->argument[line->count++] = constant;
    }
}

static char *room(job_line_t *line) {
    char *const text = line->text[line->count];
    argue(line, text);
    return text;
}

/* The member `key` names an existing file. */
static bool argue_file(job_line_t *line, json_t *message, const char *key, file_kind_t kind, failure_t *failure) {
    char name[256] = "";
    return message_text(message, key, name, sizeof name, failure) &&
           folder_file(line->folder, name, kind, room(line), failure);
}

/* The member "recordings" names one or several. */
static bool argue_recordings(job_line_t *line, json_t *message, failure_t *failure) {
    static const size_t most = 8;
    json_t *const list = json_object_get(message, "recordings");
    const size_t count = json_array_size(list);
    if (count < 1 || count > most) {
        return fail(failure, "recordings: from one to %zu names", most);
    }
    for (size_t i = 0; i < count; i++) {
        const char *const name = json_string_value(json_array_get(list, i));
        if (name == NULL) {
            return fail(failure, "recordings: not names");
        }
        if (!folder_file(line->folder, name, FILE_RECORDING_KIND, room(line), failure)) {
            return false;
        }
    }
    return true;
}

static bool argue_output(job_line_t *line, const char *option, size_t which, failure_t *failure) {
    argue(line, option);
    return folder_path(line->folder, line->made[which], room(line), failure);
}

static bool argue_flag(job_line_t *line, json_t *message, const char *key, const char *option, failure_t *failure) {
    bool set = false;
    if (!message_flag(message, key, &set, failure)) {
        return false;
    }
    if (set) {
        argue(line, option);
    }
    return true;
}

/* Of a recording that was refused because its columns look exchanged. */
static bool argue_columns(job_line_t *line, json_t *message, failure_t *failure) {
    return argue_flag(line, message, "columns_are_right", "--columns-are-right", failure);
}

static bool fit_line(job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".json"};
    char family[64] = "";
    bool creep = false;
    argue(line, "fit");
    if (!argue_recordings(line, message, failure) || !message_text(message, "family", family, sizeof family, failure) ||
        !message_flag(message, "creep", &creep, failure) || !argue_columns(line, message, failure) ||
        !folder_free_names(line->folder, "model", suffix, 1, line->made, failure) ||
        !argue_output(line, "-o", 0, failure)) {
        return false;
    }
    if (family[0] != '\0') {
        argue(line, "--family");
        (void)snprintf(room(line), FOLDER_PATH, "%s", family);
    }
    if (creep) {
        argue(line, "--creep");
    }
    return true;
}

static bool diagnose_line(job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".html", ".json"};
    argue(line, "diagnose");
    if (!argue_recordings(line, message, failure) || !argue_columns(line, message, failure) ||
        !folder_free_names(line->folder, "diagnosis", suffix, 2, line->made, failure) ||
        !argue_output(line, "--report", 0, failure) || !argue_output(line, "-o", 1, failure)) {
        return false;
    }
    if (json_object_get(message, "model") == NULL) {
        return true;
    }
    argue(line, "--model");
    return argue_file(line, message, "model", FILE_MODEL_KIND, failure);
}

static bool compile_line(job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".image"};
    char model[256] = "";
    char stem[256];
    argue(line, "compile");
    if (!argue_file(line, message, "model", FILE_MODEL_KIND, failure) ||
        !message_text(message, "model", model, sizeof model, failure)) {
        return false;
    }
    (void)snprintf(stem, sizeof stem, "%.*s", (int)(strlen(model) - strlen(".json")), model);
    if (!folder_free_names(line->folder, stem, suffix, 1, line->made, failure) ||
        !argue_output(line, "-o", 0, failure)) {
        return false;
    }
    if (line->sample_rate_hz > 0.0) {
        argue(line, "--sample-rate");
        (void)snprintf(room(line), FOLDER_PATH, "%.9g", line->sample_rate_hz);
    }
    return true;
}

static bool look_line(job_line_t *line, json_t *message, failure_t *failure) {
    argue(line, "look");
    return argue_recordings(line, message, failure);
}

/* A recording, or measurements that are to become one. */
static bool argue_measurements(job_line_t *line, json_t *message, char name[FOLDER_NAME], failure_t *failure) {
    if (!message_text(message, "file", name, FOLDER_NAME, failure)) {
        return false;
    }
    const bool recording = folder_kind(line->folder, name) == FILE_RECORDING_KIND;
    return folder_file(line->folder, name, recording ? FILE_RECORDING_KIND : FILE_MEASUREMENTS_KIND, room(line),
                       failure);
}

/* What the file does not say: names or numbers of columns, and numbers, each an option of the command. */
static bool argue_wishes(job_line_t *line, json_t *message, failure_t *failure) {
    static const struct {
        const char *key, *option;
        bool number;
    } wishes[] = {{"time", "--time", false},
                  {"drive", "--drive", false},
                  {"displacement", "--displacement", false},
                  {"sample_rate_hz", "--sample-rate", true},
                  {"drive_scale", "--drive-scale", true},
                  {"displacement_scale", "--displacement-scale", true}};
    for (size_t i = 0; i < sizeof wishes / sizeof wishes[0]; i++) {
        char text[256] = "";
        double number = 0.0;
        if (!(wishes[i].number ? message_number(message, wishes[i].key, &number, failure)
                               : message_text(message, wishes[i].key, text, sizeof text, failure))) {
            return false;
        }
        if (strchr(text, '*') != NULL) {
            return fail(failure, "%s: a '*' is for several actuators in a file: hyst import in a terminal",
                        wishes[i].key);
        }
        if (wishes[i].number && number != 0.0) {
            (void)snprintf(text, sizeof text, "%.9g", number);
        }
        if (text[0] != '\0') {
            argue(line, wishes[i].option);
            (void)snprintf(room(line), FOLDER_PATH, "%s", text);
        }
    }
    return true;
}

static bool import_line(job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".h5"}; /* which keeps all columns */
    char name[FOLDER_NAME] = "";
    bool write = true;
    argue(line, "import");
    if (!argue_measurements(line, message, name, failure) || !argue_wishes(line, message, failure) ||
        !argue_flag(line, message, "fill_missing", "--fill-missing", failure) ||
        !argue_flag(line, message, "drop_held", "--drop-held", failure) ||
        !message_flag(message, "write", &write, failure)) {
        return false;
    }
    name[strcspn(name, ".")] = '\0';
    return !write || (folder_free_names(line->folder, name, suffix, 1, line->made, failure) &&
                      argue_output(line, "-o", 0, failure));
}

static bool simulate_line(job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".csv"};
    argue(line, "simulate");
    return argue_file(line, message, "model", FILE_MODEL_KIND, failure) &&
           argue_file(line, message, "recording", FILE_RECORDING_KIND, failure) &&
           folder_free_names(line->folder, "simulated", suffix, 1, line->made, failure) &&
           argue_output(line, "-o", 0, failure);
}

static bool report_line(job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".html"};
    char name[2][256] = {"", ""};
    char path[2][FOLDER_PATH];
    argue(line, "report");
    if (!argue_file(line, message, "model", FILE_MODEL_KIND, failure) ||
        !argue_file(line, message, "recording", FILE_RECORDING_KIND, failure) ||
        !message_text(message, "before", name[0], sizeof name[0], failure) ||
        !message_text(message, "after", name[1], sizeof name[1], failure) ||
        !folder_file(line->folder, name[0], FILE_RECORDING_KIND, path[0], failure) ||
        !folder_file(line->folder, name[1], FILE_RECORDING_KIND, path[1], failure)) {
        return false;
    }
    const int length = snprintf(room(line), FOLDER_PATH, "track=%s,%s", path[0], path[1]);
    return (length < FOLDER_PATH || fail(failure, "%s: name too long", name[0])) &&
           folder_free_names(line->folder, "report", suffix, 1, line->made, failure) &&
           argue_output(line, "-o", 0, failure);
}

static const struct {
    const char *name;
    bool (*line)(job_line_t *line, json_t *message, failure_t *failure);
} kinds[] = {{"fit", fit_line},           {"diagnose", diagnose_line}, {"compile", compile_line}, {"look", look_line},
             {"simulate", simulate_line}, {"report", report_line},     {"import", import_line}};

bool job_line_knows(const char *name) {
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        if (strcmp(name, kinds[i].name) == 0) {
            return true;
        }
    }
    return false;
}

job_line_t *job_line_read(const char *name, json_t *message, const char *folder, double sample_rate_hz,
                          failure_t *failure) {
    job_line_t *line = allocate(1, sizeof *line);
    line->folder = folder;
    line->sample_rate_hz = sample_rate_hz;
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        if (strcmp(name, kinds[i].name) == 0 && kinds[i].line(line, message, failure)) {
            return line;
        }
    }
    free(line);
    return NULL;
}
