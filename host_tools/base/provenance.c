/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/provenance.h"
#include "base/checksum.h"
#include "base/failure.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static struct {
    char *command, *device;
    char **path;
    size_t paths;
} noted;

/* What a shell takes as it stands. */
static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,:/@%";

/* The word as a shell takes it, at `text`, which has room for four characters of each; returns its end. */
static char *quote(const char *word, char *text) {
    const bool bare = word[0] != '\0' && strspn(word, plain) == strlen(word);
    if (!bare) {
        *text++ = '\'';
    }
    for (; *word != '\0'; word++) {
        for (const char *end = "'\\'"; *word == '\'' && *end != '\0'; end++) { /* ends the quotes for a quote */
            *text++ = *end;
        }
        *text++ = *word;
    }
    if (!bare) {
        *text++ = '\'';
    }
    return text;
}

void provenance_begin(int argc, char *const *argv) {
    size_t room = 1;
    for (int i = 0; i < argc; i++) {
        room += 4 * strlen(argv[i]) + 3;
    }
    free(noted.command);
    free(noted.device);
    for (size_t i = 0; i < noted.paths; i++) {
        free(noted.path[i]);
    }
    free(noted.path);
    memset(&noted, 0, sizeof noted);
    noted.command = allocate(room, 1);
    char *end = noted.command;
    for (int i = 0; i < argc; i++) {
        const char *slash = i == 0 ? strrchr(argv[0], '/') : NULL; /* where the program lies is of no interest */
        end = quote(slash != NULL ? slash + 1 : argv[i], end);
        *end++ = i + 1 < argc ? ' ' : '\0';
    }
}

void provenance_add_file(const char *path) {
    for (size_t i = 0; i < noted.paths; i++) {
        if (strcmp(noted.path[i], path) == 0) {
            return;
        }
    }
    noted.path = reallocate(noted.path, noted.paths + 1, sizeof *noted.path);
    noted.path[noted.paths++] = copy_text(path);
}

void provenance_set_device(const char *device) {
    free(noted.device);
    noted.device = copy_text(device);
}

static void write_date(char *date, size_t size) {
    const char *epoch = getenv("SOURCE_DATE_EPOCH");
    const time_t now = epoch != NULL ? (time_t)strtoll(epoch, NULL, 10) : time(NULL);
    struct tm utc;
    date[0] = '\0';
    if (gmtime_r(&now, &utc) != NULL && strftime(date, size, "%Y-%m-%d %H:%M:%S UTC", &utc) == 0) {
        date[0] = '\0'; /* a year of more than four digits */
    }
}

void provenance_now(provenance_t *provenance) {
    *provenance = (provenance_t){
        .command = noted.command, .device = noted.device, .file = allocate(noted.paths, sizeof *provenance->file)};
    write_date(provenance->date, sizeof provenance->date);
    for (size_t i = 0; i < noted.paths; i++) {
        provenance_file_t *file = &provenance->file[provenance->files];
        if (file_sha256(noted.path[i], file->sha256)) {
            file->path = noted.path[i];
            provenance->files++;
        }
    }
}

void provenance_free(provenance_t *provenance) {
    free(provenance->file);
    memset(provenance, 0, sizeof *provenance);
}
