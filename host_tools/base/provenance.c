/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/provenance.h"
#include "base/checksum.h"
#include "base/failure.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct provenance_note {
    char *command, *device, *title;
    char **path;
    size_t paths;
};

static _Thread_local provenance_note_t *entered;

provenance_note_t *provenance_note(void) {
    return allocate(1, sizeof(provenance_note_t));
}

void provenance_note_free(provenance_note_t *note) {
    if (note != NULL) {
        free(note->command);
        free(note->device);
        free(note->title);
        for (size_t i = 0; i < note->paths; i++) {
            free(note->path[i]);
        }
        free(note->path);
        free(note);
    }
}

const provenance_note_t *provenance_entered(void) {
    return entered;
}

provenance_note_t *provenance_enter(provenance_note_t *note) {
    provenance_note_t *before = entered;
    entered = note;
    return before;
}

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

void provenance_set_command(int argc, char *const *argv) {
    size_t room = 1;
    if (entered == NULL) {
        return;
    }
    for (int i = 0; i < argc; i++) {
        room += 4 * strlen(argv[i]) + 3;
    }
    free(entered->command);
    entered->command = allocate(room, 1);
    char *end = entered->command;
    for (int i = 0; i < argc; i++) {
        const char *slash = i == 0 ? strrchr(argv[0], '/') : NULL; /* where the program lies is of no interest */
        end = quote(slash != NULL ? slash + 1 : argv[i], end);
        *end++ = i + 1 < argc ? ' ' : '\0';
    }
}

void provenance_note_add_file(provenance_note_t *note, const char *path) {
    for (size_t i = 0; i < note->paths; i++) {
        if (strcmp(note->path[i], path) == 0) {
            return;
        }
    }
    note->path = reallocate(note->path, note->paths + 1, sizeof *note->path);
    note->path[note->paths++] = copy_text(path);
}

void provenance_add_file(const char *path) {
    if (entered != NULL) {
        provenance_note_add_file(entered, path);
    }
}

void provenance_set_device(const char *device) {
    if (entered != NULL) {
        free(entered->device);
        entered->device = copy_text(device);
    }
}

void provenance_add_device(const char *device) {
    if (entered == NULL || (entered->device != NULL && strstr(entered->device, device) != NULL)) {
        return;
    }
    const size_t before = entered->device != NULL ? strlen(entered->device) : 0, room = before + strlen(device) + 3;
    entered->device = reallocate(entered->device, room, 1);
    (void)snprintf(entered->device + before, room - before, "%s%s", before > 0 ? "; " : "", device);
}

void provenance_note_set_title(provenance_note_t *note, const char *title) {
    free(note->title);
    note->title = title != NULL ? copy_text(title) : NULL;
}

void provenance_set_title(const char *title) {
    if (entered != NULL) {
        provenance_note_set_title(entered, title);
    }
}

const char *provenance_title(void) {
    return entered != NULL ? entered->title : NULL;
}

static void take_text(char **text, const char *other) {
    if (*text == NULL && other != NULL) {
        *text = copy_text(other);
    }
}

void provenance_note_add(provenance_note_t *note, const provenance_note_t *other) {
    if (other != NULL) {
        take_text(&note->command, other->command);
        take_text(&note->device, other->device);
        for (size_t i = 0; i < other->paths; i++) {
            provenance_note_add_file(note, other->path[i]);
        }
    }
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
    static const provenance_note_t none;
    const provenance_note_t *note = entered != NULL ? entered : &none;
    *provenance = (provenance_t){
        .command = note->command, .device = note->device, .file = allocate(note->paths, sizeof *provenance->file)};
    write_date(provenance->date, sizeof provenance->date);
    for (size_t i = 0; i < note->paths; i++) {
        provenance_file_t *file = &provenance->file[provenance->files];
        if (file_sha256(note->path[i], file->sha256)) {
            file->path = note->path[i];
            provenance->files++;
        }
    }
}

void provenance_free(provenance_t *provenance) {
    free(provenance->file);
    memset(provenance, 0, sizeof *provenance);
}
