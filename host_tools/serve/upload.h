/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * A file that a page gives to the folder: announced by a message, then sent by HTTP to an address that only the page
 * which announced it knows. One at a time.
 *
 * It is written by a thread, for a disk may be slow and the server's thread carries Stop. What waits for the disk is
 * bounded: the server takes no more from the page meanwhile. A file that does not come whole, or cannot be written,
 * leaves nothing; one that exists is never replaced.
 */
#ifndef UPLOAD_H
#define UPLOAD_H

#include "serve/access.h"
#include "serve/folder.h"

typedef struct upload upload_t;

/** Largest file in bytes: what is larger is copied into the folder by other means. */
#define UPLOAD_MOST 1000000000L

typedef struct {
    /** There is room again. In the thread of the upload. */
    void (*room)(void *context);
    /** The file is in the folder, or why it is not. In the thread of the upload. */
    void (*ended)(void *context, const char *name, bool good, const failure_t *why);
    void *context;
} upload_listener_t;

/** folder and listener must outlive it. NULL on failure. */
upload_t *upload_start(const char *folder, const upload_listener_t *listener, failure_t *failure);
/** What has not come whole is forgotten. NULL is allowed. */
void upload_end(upload_t *upload);

/* The rest is for the server's thread. */

/**
 * A page wants to send `bytes` bytes of a file that it calls `wished`: its name here, and the key under which it is
 * sent, once. An earlier key that was not used is of no use any more. Refuses while another file comes.
 */
bool upload_announce(upload_t *upload, unsigned long client, const char *wished, long bytes, char name[1][FOLDER_NAME],
                     char key[ACCESS_TOKEN_LENGTH + 1], failure_t *failure);

/** The page has gone: a file that it only announced does not come. */
void upload_withdraw(upload_t *upload, unsigned long client);

/** The file of this key begins to come, with so many bytes. False: it was not announced so. */
bool upload_begin(upload_t *upload, const char *key, long bytes);

/** A part of it. False: no more before listener.room, but what is on the way. */
bool upload_give(upload_t *upload, const void *part, size_t length);

/** No more comes. */
void upload_finish(upload_t *upload, bool whole);

#endif
