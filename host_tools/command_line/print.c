/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command_line/print.h"
#include "amplifier/driving.h"
#include "base/output_file.h"
#include "loop/telemetry.h"
#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

int failure_print(const failure_t *failure) {
    fprintf(stderr, "hyst: %s\n", failure->text);
    return STATUS_FAILED;
}

static struct {
    const char *file; /* NULL: stdout */
    bool open;
    output_file_t lines;
} json;

void json_into(const char *file) {
    json.file = file;
}

const char *json_file(void) {
    return json.file;
}

bool text_wanted(bool wanted) {
    return !wanted || json.file != NULL;
}

/* To a stream, and drops the reference. */
static bool dump(json_t *value, size_t flags, FILE *file, failure_t *failure) {
    if (value == NULL) { /* JSON has no infinity and no NaN, and jansson makes no value of them */
        return fail(failure, "the result holds a number that is not finite");
    }
    const bool written = json_dumpf(value, file, flags) == 0 && fputc('\n', file) != EOF && fflush(file) == 0;
    json_decref(value);
    return written || fail(failure, "cannot write the result to %s", json.file != NULL ? json.file : "stdout");
}

bool json_print(json_t *value, size_t flags, failure_t *failure) {
    output_file_t output;
    if (json.file == NULL) {
        return dump(value, flags, stdout, failure);
    }
    if (!output_file_open(&output, json.file, failure)) {
        json_decref(value);
        return false;
    }
    return output_file_close(&output, dump(value, flags, output.file, failure), failure);
}

bool json_print_line(json_t *value, failure_t *failure) {
    if (json.file != NULL && !json.open && !(json.open = output_file_open(&json.lines, json.file, failure))) {
        json_decref(value);
        return false;
    }
    return dump(value, JSON_COMPACT, json.file != NULL ? json.lines.file : stdout, failure);
}

bool json_end(bool good, failure_t *failure) {
    if (!json.open) {
        return good;
    }
    json.open = false;
    return output_file_close(&json.lines, good, failure);
}

bool reader_has_left(void) {
    struct pollfd end = {.fd = STDOUT_FILENO};
    return ferror(stdout) != 0 && poll(&end, 1, 0) == 1 && (end.revents & POLLERR) != 0;
}

static void print_event(int64_t samples, const char *what) {
    if (samples > 0) {
        (void)fprintf(stderr, "note: %s in %" PRId64 " samples\n", what, samples);
    }
}

void experiment_print_events(const experiment_events_t *events) {
#define COUNTER(name, address, note, text) print_event(events->name, note);
#include "registers/registers.def"
}

static void print_left_fault(void *nothing, int64_t tripped) {
    (void)nothing;
    (void)fprintf(stderr, "note: %s\n", driving_fault(tripped).text);
}

void device_print_left_fault(device_t *device) {
    device_when_left_fault(device, print_left_fault, NULL);
}

void device_print_driven(device_t *device) {
    int64_t now[REGISTER_COUNT];
    failure_t ignored;
    if (device_read_telemetry(device, now, &ignored) && now[INDEX_state] != LOOP_PARKED) {
        (void)fprintf(stderr, "note: the amplifier is driven, in mode %s: the image takes over meanwhile\n",
                      mode_name(now[INDEX_active_mode]));
    }
}

void out_of_memory_print(size_t count, size_t size) {
    fprintf(stderr, "hyst: out of memory (%zu elements of %zu bytes)\n", count, size);
    exit(STATUS_FAILED);
}
