/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/upload.h"
#include "base/output_file.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Bytes that may wait for the disk; from half of them on the page has to wait, too. */
#define MOST_WAITING ((size_t)1 << 18)

typedef enum {
    UPLOAD_NONE,
    UPLOAD_ANNOUNCED,
    UPLOAD_COMES,
    UPLOAD_WHOLE, /* all of it has come, and is being written */
    UPLOAD_BROKEN /* no more of it will come */
} upload_state_t;

struct upload {
    const char *folder;
    const upload_listener_t *listener;
    pthread_t thread;
    /* Shared, under the lock. */
    pthread_mutex_t lock;
    pthread_cond_t changed;
    upload_state_t state;
    unsigned long client;
    char name[FOLDER_NAME], key[ACCESS_TOKEN_LENGTH + 1];
    long bytes, come;
    unsigned char *waiting; /* room for MOST_WAITING */
    size_t count;
    bool ending;
};

/* Takes what waits. Returns its length, 0 at the end of what comes, with *whole. */
static size_t take(upload_t *upload, unsigned char **empty, bool *whole) {
    pthread_mutex_lock(&upload->lock);
    while (upload->count == 0 && upload->state == UPLOAD_COMES) {
        pthread_cond_wait(&upload->changed, &upload->lock);
    }
    unsigned char *const full = upload->waiting;
    const size_t count = upload->count;
    *whole = upload->state != UPLOAD_BROKEN;
    upload->waiting = *empty;
    upload->count = 0;
    pthread_mutex_unlock(&upload->lock);
    *empty = full;
    return count;
}

/* One file, from its first byte to its place. */
static bool write_file(upload_t *upload, failure_t *failure) {
    char path[FOLDER_PATH];
    output_file_t output;
    const bool opened =
        folder_path(upload->folder, upload->name, path, failure) && output_file_open_copy(&output, path, failure);
    unsigned char *part = allocate(MOST_WAITING, 1);
    bool good = false;
    for (size_t length; (length = take(upload, &part, &good)) > 0;) {
        upload->listener->room(upload->listener->context);
        if (opened && ferror(output.file) == 0) { /* what went wrong is said when it is closed */
            (void)fwrite(part, 1, length, output.file);
        }
    }
    free(part);
    if (!opened) {
        return false;
    }
    if (!good) {
        (void)fail(failure, "%s: its page has gone before all of it came", upload->name);
    } else if (fflush(output.file) == 0 && !folder_holds(upload->name, output.part)) {
        good = fail(failure, "%s: not a model of hyst", upload->name);
    } else if (access(path, F_OK) == 0) {
        good = fail(failure, "%s: was made meanwhile. Send it once more: it gets another name", upload->name);
    }
    return output_file_close(&output, good, failure);
}

static void *write_files(void *context) {
    upload_t *const upload = context;
    pthread_mutex_lock(&upload->lock);
    while (!upload->ending) {
        if (upload->state < UPLOAD_COMES) {
            pthread_cond_wait(&upload->changed, &upload->lock);
            continue;
        }
        pthread_mutex_unlock(&upload->lock);
        failure_t failure;
        const bool good = write_file(upload, &failure);
        char name[FOLDER_NAME];
        (void)snprintf(name, sizeof name, "%s", upload->name);
        pthread_mutex_lock(&upload->lock);
        upload->state = UPLOAD_NONE;
        pthread_mutex_unlock(&upload->lock);
        upload->listener->ended(upload->listener->context, name, good, &failure);
        pthread_mutex_lock(&upload->lock);
    }
    pthread_mutex_unlock(&upload->lock);
    return NULL;
}

bool upload_announce(upload_t *upload, unsigned long client, const char *wished, long bytes, char name[1][FOLDER_NAME],
                     char key[ACCESS_TOKEN_LENGTH + 1], failure_t *failure) {
    if (bytes <= 0) {
        return fail(failure, "%.100s: is empty", wished);
    }
    if (bytes > UPLOAD_MOST) {
        return fail(failure, "%.100s: %.1f GB. A page sends at most %.0f GB: copy it into the folder", wished,
                    1e-9 * (double)bytes, 1e-9 * (double)UPLOAD_MOST);
    }
    if (!folder_name_for(upload->folder, wished, name, failure) || !access_draw_token(key, failure)) {
        return false;
    }
    pthread_mutex_lock(&upload->lock);
    const bool busy = upload->state >= UPLOAD_COMES;
    if (!busy) {
        upload->state = UPLOAD_ANNOUNCED;
        upload->client = client;
        upload->bytes = bytes;
        upload->come = 0;
        (void)snprintf(upload->name, sizeof upload->name, "%s", name[0]);
        (void)snprintf(upload->key, sizeof upload->key, "%s", key);
    }
    pthread_mutex_unlock(&upload->lock);
    return !busy || fail(failure, "another file comes: wait for it");
}

void upload_withdraw(upload_t *upload, unsigned long client) {
    pthread_mutex_lock(&upload->lock);
    if (upload->state == UPLOAD_ANNOUNCED && upload->client == client) {
        upload->state = UPLOAD_NONE;
    }
    pthread_mutex_unlock(&upload->lock);
}

bool upload_begin(upload_t *upload, const char *key, long bytes) {
    pthread_mutex_lock(&upload->lock);
    const bool right = upload->state == UPLOAD_ANNOUNCED && upload->bytes == bytes && strcmp(upload->key, key) == 0;
    if (right) {
        upload->state = UPLOAD_COMES;
        pthread_cond_signal(&upload->changed);
    }
    pthread_mutex_unlock(&upload->lock);
    return right;
}

bool upload_give(upload_t *upload, const void *part, size_t length) {
    pthread_mutex_lock(&upload->lock);
    if (upload->state == UPLOAD_COMES) {
        if (length > MOST_WAITING - upload->count || upload->come + (long)length > upload->bytes) {
            upload->state = UPLOAD_BROKEN; /* does not wait, or is longer than it was announced */
        } else {
            memcpy(upload->waiting + upload->count, part, length);
            upload->count += length;
            upload->come += (long)length;
        }
        pthread_cond_signal(&upload->changed);
    }
    const bool room = upload->count < MOST_WAITING / 2;
    pthread_mutex_unlock(&upload->lock);
    return room;
}

void upload_finish(upload_t *upload, bool whole) {
    pthread_mutex_lock(&upload->lock);
    if (upload->state == UPLOAD_COMES) {
        upload->state = whole && upload->come == upload->bytes ? UPLOAD_WHOLE : UPLOAD_BROKEN;
        pthread_cond_signal(&upload->changed);
    }
    pthread_mutex_unlock(&upload->lock);
}

upload_t *upload_start(const char *folder, const upload_listener_t *listener, failure_t *failure) {
    upload_t *upload = allocate(1, sizeof *upload);
    upload->folder = folder;
    upload->listener = listener;
    upload->waiting = allocate(MOST_WAITING, 1);
    (void)pthread_mutex_init(&upload->lock, NULL);
    (void)pthread_cond_init(&upload->changed, NULL);
    if (pthread_create(&upload->thread, NULL, write_files, upload) != 0) {
        (void)fail(failure, "cannot start a thread");
        free(upload->waiting);
        free(upload);
        return NULL;
    }
    return upload;
}

void upload_end(upload_t *upload) {
    if (upload == NULL) {
        return;
    }
    pthread_mutex_lock(&upload->lock);
    upload->ending = true;
    upload->state = upload->state == UPLOAD_COMES ? UPLOAD_BROKEN : upload->state;
    pthread_cond_signal(&upload->changed);
    pthread_mutex_unlock(&upload->lock);
    (void)pthread_join(upload->thread, NULL);
    (void)pthread_cond_destroy(&upload->changed);
    (void)pthread_mutex_destroy(&upload->lock);
    free(upload->waiting);
    free(upload);
}
