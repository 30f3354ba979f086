/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "commands/diagnose_script.h"
#include "base/output_file.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* A path, or a title, as a Python expression. Only what is plain ASCII is a string as it stands; it may be any bytes.
 */
static void write_path(FILE *file, const char *path) {
    bool plain = true;
    for (const char *at = path; *at != '\0'; at++) {
        plain = plain && *at >= ' ' && *at <= '~' && *at != '"' && *at != '\\';
    }
    if (plain) {
        fprintf(file, "\"%s\"", path);
        return;
    }
    fputs("os.fsdecode(b\"", file);
    for (const char *at = path; *at != '\0'; at++) {
        fprintf(file, "\\x%02x", (unsigned)(unsigned char)*at);
    }
    fputs("\")", file);
}

static void write_call(FILE *file, const char *before, const char *path, const char *after) {
    fputs(before, file);
    write_path(file, path);
    fputs(after, file);
}

static void write_script(FILE *file, const diagnose_script_t *script) {
    fputs("# Written by hyst " HYST_VERSION ": what `hyst diagnose` did, by the Python package of the same name.\n"
          "import json\nimport os\n\nimport hyst\n\nrecordings = [\n",
          file);
    for (size_t i = 0; i < script->count; i++) {
        write_call(file, "    hyst.read(", script->recordings[i], ")");
        if (isfinite(script->from_s) || isfinite(script->to_s)) {
            fprintf(file, ".span(float(\"%.17g\"), float(\"%.17g\"))", script->from_s, script->to_s);
        }
        fputs(",\n", file);
    }
    fputs("]\n", file);
    if (script->model != NULL) {
        write_call(file, "model = hyst.Model.load(", script->model, ")\n");
    } else {
        fputs("model = None # begin with the hysteresis that fits best\n", file);
    }
    fputs("diagnosis = hyst.diagnose(recordings, model", file);
    if (script->samples > 0) {
        fprintf(file, ", samples=%lu", script->samples);
    }
    if (script->columns_are_right) {
        fputs(", columns_are_right=True", file);
    }
    if (script->sure > 0) {
        fprintf(file, ", sure=%zu, seed=%lu", script->sure, script->seed);
    }
    fputs(")\n", file);
    if (script->output != NULL) {
        write_call(file, "diagnosis.save(", script->output, ")\n");
    }
    fputs("print(diagnosis, end=\"\")\n", file);
    if (script->report != NULL) {
        write_call(file, "diagnosis.report(", script->report, "");
        if (script->title != NULL) {
            write_call(file, ", title=", script->title, "");
        }
        fputs(")\n", file);
    }
    if (script->json != NULL) {
        write_call(file, "with open(", script->json, ", \"w\", encoding=\"utf-8\") as file:\n");
        fputs("    json.dump(diagnosis.json, file, indent=1)\n", file);
    }
}

bool diagnose_script_write(const diagnose_script_t *script, const char *path, failure_t *failure) {
    output_file_t output;
    if (!output_file_open(&output, path, failure)) {
        return false;
    }
    write_script(output.file, script);
    return output_file_close(&output, true, failure);
}
