/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/reader.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

/* Samples of a recording that a page gets. */
#define SHOWN_SAMPLES 4000
/* Recordings that are wanted at once. */
#define MOST_WAITING 32

typedef struct wish wish_t;
struct wish {
    wish_t *next;
    unsigned long client;
    char name[FOLDER_NAME];
};

struct reader {
    const char *folder;
    const reader_listener_t *listener;
    pthread_t thread;
    /* Shared, under the lock. */
    pthread_mutex_t lock;
    pthread_cond_t wished;
    wish_t *wishes;
    bool ending;
};

static void *read_wishes(void *context) {
    reader_t *const reader = context;
    pthread_mutex_lock(&reader->lock);
    while (!reader->ending) {
        wish_t *const wish = reader->wishes;
        if (wish == NULL) {
            pthread_cond_wait(&reader->wished, &reader->lock);
            continue;
        }
        reader->wishes = wish->next;
        pthread_mutex_unlock(&reader->lock);
        failure_t failure;
        json_t *const recording = folder_recording(reader->folder, wish->name, SHOWN_SAMPLES, &failure);
        reader->listener->done(reader->listener->context, wish->client, recording, &failure);
        free(wish);
        pthread_mutex_lock(&reader->lock);
    }
    pthread_mutex_unlock(&reader->lock);
    return NULL;
}

bool reader_want(reader_t *reader, unsigned long client, const char *name, failure_t *failure) {
    char path[FOLDER_PATH];
    if (!folder_file(reader->folder, name, FILE_RECORDING_KIND, path, failure)) {
        return false;
    }
    wish_t *wish = allocate(1, sizeof *wish);
    wish->client = client;
    (void)snprintf(wish->name, sizeof wish->name, "%s", name);
    size_t waiting = 0;
    pthread_mutex_lock(&reader->lock);
    wish_t **end = &reader->wishes;
    for (; *end != NULL; end = &(*end)->next) {
        waiting++;
    }
    const bool room = waiting < MOST_WAITING;
    if (room) {
        *end = wish;
        pthread_cond_signal(&reader->wished);
    }
    pthread_mutex_unlock(&reader->lock);
    if (!room) {
        free(wish);
        return fail(failure, "too many recordings at once");
    }
    return true;
}

reader_t *reader_start(const char *folder, const reader_listener_t *listener, failure_t *failure) {
    reader_t *reader = allocate(1, sizeof *reader);
    reader->folder = folder;
    reader->listener = listener;
    (void)pthread_mutex_init(&reader->lock, NULL);
    (void)pthread_cond_init(&reader->wished, NULL);
    if (pthread_create(&reader->thread, NULL, read_wishes, reader) != 0) {
        (void)fail(failure, "cannot start a thread");
        free(reader);
        return NULL;
    }
    return reader;
}

void reader_end(reader_t *reader) {
    if (reader == NULL) {
        return;
    }
    pthread_mutex_lock(&reader->lock);
    reader->ending = true;
    pthread_cond_signal(&reader->wished);
    pthread_mutex_unlock(&reader->lock);
    (void)pthread_join(reader->thread, NULL);
    for (wish_t *wish; (wish = reader->wishes) != NULL;) {
        reader->wishes = wish->next;
        free(wish);
    }
    (void)pthread_cond_destroy(&reader->wished);
    (void)pthread_mutex_destroy(&reader->lock);
    free(reader);
}
