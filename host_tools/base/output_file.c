/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/output_file.h"
#include "base/file_ending.h"
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Parts of processes that were killed may have taken a name. */
#define PART_TRIES 100

/* Parts, for a signal handler. More than these it does not remove. */
#define KNOWN_PARTS 4

enum { PLACE_FREE, PLACE_TAKEN, PLACE_NAMES_PART };

static struct {
    atomic_int state;
    char path[PATH_MAX];
} known[KNOWN_PARTS];

/* Before the file is made: there is no moment in which it exists and is not known. */
static void know_part(const char *path) {
    const size_t size = strlen(path) + 1;
    for (size_t i = 0; i < KNOWN_PARTS && size <= sizeof known[i].path; i++) {
        int state = PLACE_FREE;
        if (atomic_compare_exchange_strong(&known[i].state, &state, PLACE_TAKEN)) {
            memcpy(known[i].path, path, size);
            atomic_store(&known[i].state, PLACE_NAMES_PART);
            return;
        }
    }
}

static void part_has_gone(const char *path) {
    for (size_t i = 0; i < KNOWN_PARTS; i++) {
        if (atomic_load(&known[i].state) == PLACE_NAMES_PART && strcmp(known[i].path, path) == 0) {
            atomic_store(&known[i].state, PLACE_FREE);
        }
    }
}

void output_files_remove_parts(void) {
    for (size_t i = 0; i < KNOWN_PARTS; i++) {
        if (atomic_load(&known[i].state) == PLACE_NAMES_PART) {
            (void)unlink(known[i].path);
        }
    }
}

static bool begins(const char *text, const char *with) {
    return strncmp(text, with, strlen(with)) == 0;
}

/* Names of open files: renaming something over what they name would not reach whoever holds them open. */
static bool names_open_file(const char *path) {
    return begins(path, "/dev/std") || begins(path, "/dev/fd/") || begins(path, "/proc/");
}

/* Endings of formats that nothing here writes. */
static const char *const of_others[] = {".mat", ".npy", ".npz", ".tdms", ".xls", ".xlsx",
                                        ".gz",  ".zip", ".pdf", ".png",  NULL};

/* The folder of `path`, resolved, with '/' and `name` behind it. NULL with errno set. */
static char *beside(const char *path, const char *name) {
    const char *slash = strrchr(path, '/');
    char *folder = slash == NULL ? copy_text(".") : copy_text(path);
    if (slash != NULL) {
        folder[slash == path ? 1 : slash - path] = '\0';
    }
    char *resolved = realpath(folder, NULL);
    free(folder);
    if (resolved == NULL) {
        return NULL;
    }
    const size_t size = strlen(resolved) + strlen(name) + 2;
    char *result = allocate(size, 1);
    (void)snprintf(result, size, "%s%s%s", resolved, strcmp(resolved, "/") == 0 ? "" : "/", name);
    free(resolved);
    return result;
}

/* Sets output->path, and leaves output->part NULL. *exists: it is a regular file, and *now says which. */
static bool resolve(output_file_t *output, const char *name, bool copy, bool *in_place, bool *exists, struct stat *now,
                    failure_t *failure) {
    struct stat link;
    *output = (output_file_t){.name = copy_text(name)};
    *exists = stat(name, now) == 0;
    *in_place = names_open_file(name) || (*exists && !S_ISREG(now->st_mode));
    if (*exists && S_ISDIR(now->st_mode)) {
        return fail(failure, "%s: %s", name, strerror(EISDIR));
    }
    if (*exists && access(name, W_OK) != 0) {
        return fail(failure, "%s: %s", name, strerror(errno));
    }
    *exists = *exists && S_ISREG(now->st_mode);
    if (!copy && !*in_place && file_ending(name, of_others) != NULL) {
        return fail(failure,
                    "%s: hyst writes no such files: recordings are CSV or HDF5 (.h5), others as the command says",
                    name);
    }
    if (*in_place) {
        output->path = copy_text(name);
        return true;
    }
    if (!*exists && errno != ENOENT) {
        return fail(failure, "%s: %s", name, strerror(errno));
    }
    if (!*exists && lstat(name, &link) == 0) {
        return fail(failure, "%s: a link to a file that does not exist", name);
    }
    const char *slash = strrchr(name, '/');
    const char *last = slash == NULL ? name : slash + 1;
    if (last[0] == '\0') {
        return fail(failure, "%s: not the name of a file", name);
    }
    output->path = *exists ? realpath(name, NULL) : beside(name, last);
    return output->path != NULL || fail(failure, "%s: %s", name, strerror(errno));
}

static void forget(output_file_t *output) {
    if (output->part != NULL) {
        part_has_gone(output->part);
    }
    free(output->name);
    free(output->path);
    free(output->part);
    *output = (output_file_t){0};
}

/* Makes the part, with the permissions of the file that it will replace. Returns its descriptor, or -1. */
static int open_part(output_file_t *output, const struct stat *replaced, failure_t *failure) {
    int file = -1;
    for (int i = 0; file < 0 && i < PART_TRIES; i++) {
        char name[64];
        (void)snprintf(name, sizeof name, ".hyst-%ld-%d.part", (long)getpid(), i);
        free(output->part);
        output->part = beside(output->path, name);
        if (output->part == NULL) {
            break;
        }
        know_part(output->part);
        file = open(output->part, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file < 0) {
            part_has_gone(output->part); /* it never was ours */
            if (errno != EEXIST) {
                break;
            }
        }
    }
    if (file < 0) {
        (void)fail(failure, "%s: cannot write into its folder: %s", output->name, strerror(errno));
        return -1;
    }
    /* Only root can give a file away; where that fails the new one is the writer's, as a new file would be. */
    if (replaced != NULL &&
        (fchown(file, replaced->st_uid, replaced->st_gid) != 0 || fchmod(file, replaced->st_mode & 0777) != 0)) {
        errno = 0;
    }
    return file;
}

/* Everything up to and including an empty part. */
static bool begin(output_file_t *output, const char *name, bool copy, int *file, bool *exists, struct stat *now,
                  failure_t *failure) {
    bool in_place = false;
    *file = -1;
    if (resolve(output, name, copy, &in_place, exists, now, failure) && output->path != NULL) {
        if (in_place) {
            return true;
        }
        *file = open_part(output, *exists ? now : NULL, failure);
        if (*file >= 0) {
            return true;
        }
    }
    forget(output);
    return false;
}

static bool open_output(output_file_t *output, const char *path, bool copy, failure_t *failure) {
    struct stat now;
    bool exists = false;
    int file = -1;
    if (!begin(output, path, copy, &file, &exists, &now, failure)) {
        return false;
    }
    output->file = file >= 0 ? fdopen(file, "w") : fopen(output->path, "w");
    if (output->file != NULL) {
        return true;
    }
    (void)fail(failure, "%s: %s", path, strerror(errno));
    if (file >= 0) {
        (void)close(file);
        (void)unlink(output->part);
    }
    forget(output);
    return false;
}

bool output_file_open(output_file_t *output, const char *path, failure_t *failure) {
    return open_output(output, path, false, failure);
}

bool output_file_open_copy(output_file_t *output, const char *path, failure_t *failure) {
    return open_output(output, path, true, failure);
}

/* Everything is on the disk; else errno says why not. */
static bool written(const output_file_t *output) {
    const int file = fileno(output->file);
    if (ferror(output->file) == 0) {
        return fflush(output->file) == 0 && (output->part == NULL || fsync(file) == 0);
    }
    /* errno has been overwritten since; writing one more byte sets it again. */
    if (write(file, "", 1) >= 0) {
        errno = EIO;
    }
    return false;
}

bool output_file_close(output_file_t *output, bool good, failure_t *failure) {
    if (good) {
        good = written(output) || fail(failure, "%s: could not be written: %s", output->name, strerror(errno));
    }
    if (fclose(output->file) != 0 && good) {
        good = fail(failure, "%s: could not be written: %s", output->name, strerror(errno));
    }
    if (output->part != NULL && good && rename(output->part, output->path) != 0) {
        good = fail(failure, "%s: could not be replaced: %s", output->name, strerror(errno));
    }
    if (output->part != NULL && !good) {
        (void)unlink(output->part);
    }
    forget(output);
    return good;
}

bool output_room_take(output_room_t *room, const char *path, size_t bytes, failure_t *failure) {
    struct stat ignored;
    output_file_t output;
    bool exists = false;
    int file = -1;
    *room = (output_room_t){0};
    if (!begin(&output, path, false, &file, &exists, &ignored, failure)) {
        return false;
    }
    if (file >= 0) {
        const int error = posix_fallocate(file, 0, (off_t)bytes);
        room->part = copy_text(output.part);
        (void)close(file);
        if (error != 0 && error != EOPNOTSUPP && error != EINVAL) { /* a disk that cannot tell does not refuse */
            output_room_release(room);
            forget(&output);
            return fail(failure, "%s", strerror(error));
        }
    }
    free(output.name);
    free(output.path);
    free(output.part); /* it stays known: a signal removes it */
    return true;
}

void output_room_release(output_room_t *room) {
    if (room->part != NULL) {
        (void)unlink(room->part);
        part_has_gone(room->part);
        free(room->part);
        room->part = NULL;
    }
}

/* An output as it is compared with others. */
typedef struct {
    char *path;
    bool exists;
    struct stat now;
} place_t;

static bool same_file(const struct stat *a, const struct stat *b) {
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

static bool try_output(const char *name, place_t *place, failure_t *failure) {
    output_file_t output;
    int file = -1;
    if (!begin(&output, name, false, &file, &place->exists, &place->now, failure)) {
        return false;
    }
    if (file >= 0) {
        (void)close(file);
        (void)unlink(output.part);
    }
    place->path = copy_text(output.path);
    forget(&output);
    return true;
}

bool output_files_check(const char *const *output, size_t outputs, const char *const *input, size_t inputs,
                        failure_t *failure) {
    place_t *place = allocate(outputs, sizeof *place);
    bool good = true;
    for (size_t i = 0; good && i < outputs; i++) {
        if (output[i] == NULL) {
            continue;
        }
        good = try_output(output[i], &place[i], failure);
        for (size_t k = 0; good && place[i].exists && k < inputs; k++) {
            struct stat other;
            if (input[k] != NULL && stat(input[k], &other) == 0 && same_file(&other, &place[i].now)) {
                good = fail(failure, "%s: is the same file as the input %s: name another output", output[i], input[k]);
            }
        }
        for (size_t k = 0; good && k < i; k++) {
            const bool same =
                output[k] != NULL && (place[i].exists && place[k].exists ? same_file(&place[i].now, &place[k].now)
                                                                         : strcmp(place[i].path, place[k].path) == 0);
            if (same && strcmp(place[i].path, "/dev/null") != 0) {
                good = fail(failure, "%s: is the same file as the output %s: name another", output[i], output[k]);
            }
        }
    }
    for (size_t i = 0; i < outputs; i++) {
        free(place[i].path);
    }
    free(place);
    return good;
}
