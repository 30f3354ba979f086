/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Where a result comes from: what a lab book wants beside it, and what a file that is found in a year is worth.
 *
 * A run notes what it was called with, which files it reads and which device it talks to; pages, recordings and other
 * outputs write that down. The note belongs to the run: a command has one, and in a program with many runs each has
 * another. A thread works for one run at a time (provenance_enter). Without a note, only date and version are known.
 */
#ifndef PROVENANCE_H
#define PROVENANCE_H

#include <stddef.h>

typedef struct provenance_note provenance_note_t;

/** An empty one, of one thread at a time. Freed with provenance_note_free, which takes NULL. */
provenance_note_t *provenance_note(void);
/** As provenance_add_file, in a note that need not be this thread's. */
void provenance_note_add_file(provenance_note_t *note, const char *path);
void provenance_note_free(provenance_note_t *note);
/** Adds the files of another note (NULL: none), and its device and command line where this one has none. */
void provenance_note_add(provenance_note_t *note, const provenance_note_t *other);
/** From now on this thread works for the run with this note, which must outlive that; NULL, as at the start: for none.
 * Returns the one before, to go back to. */
provenance_note_t *provenance_enter(provenance_note_t *note);
/** The note of this thread, or NULL. */
const provenance_note_t *provenance_entered(void);

/* In the note of this thread, if it has one: */

/** Notes the command line, quoted as a shell takes it. */
void provenance_set_command(int argc, char *const *argv);
/** Notes a file that is read. What is no regular file when the result is written is left out. A file counts once. */
void provenance_add_file(const char *path);
/** Notes what the run's page is to be called; NULL: as pages of its kind are. */
void provenance_set_title(const char *title);
void provenance_note_set_title(provenance_note_t *note, const char *title);
/** That title, or NULL. Valid until the next one. */
const char *provenance_title(void);
/** Notes the device: name, serial, firmware, port. */
void provenance_set_device(const char *device);
/** Notes the device that a file is of, behind others and once. */
void provenance_add_device(const char *device);

typedef struct {
    char *path;
    char sha256[65]; /**< of its contents, hexadecimal */
} provenance_file_t;

typedef struct {
    char date[24];       /**< "2026-11-23 07:36:12 UTC"; of SOURCE_DATE_EPOCH where the environment has it */
    const char *command; /**< NULL: not noted */
    const char *device;  /**< NULL: none */
    size_t files;
    provenance_file_t *file;
} provenance_t;

/** What the note of this thread knows. Reads the files, for their checksums. To be freed; valid until the next note. */
void provenance_now(provenance_t *provenance);
void provenance_free(provenance_t *provenance);

#endif
