/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Reads recordings for the pages, in a separate thread: reading a long one takes time. */
#ifndef READER_H
#define READER_H

#include "serve/folder.h"

typedef struct reader reader_t;

typedef struct {
    /** The recording that a page wanted (folder_recording), a new reference; NULL: why not. In the reader's thread. */
    void (*done)(void *context, unsigned long client, json_t *recording, const failure_t *why);
    void *context;
} reader_listener_t;

/** The folder's name and the listener must outlive it. NULL on failure. */
reader_t *reader_start(const char *folder, const reader_listener_t *listener, failure_t *failure);
/** Ends after the recording that it reads, and frees it. NULL is allowed. */
void reader_end(reader_t *reader);

/** For this client. False: there is no such recording, or too many are waiting. */
bool reader_want(reader_t *reader, unsigned long client, const char *name, failure_t *failure);

#endif
