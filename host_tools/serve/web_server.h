/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * HTTP and WebSocket on the loopback address, by libwebsockets: one page, files in both directions, and messages.
 *
 * A request without the token, with a foreign Host or a foreign Origin gets 403, whatever it is for. All callbacks come
 * in the thread of web_server_run and must be quick; messages may be sent from any thread.
 */
#ifndef WEB_SERVER_H
#define WEB_SERVER_H

#include "base/failure.h"
#include "serve/access.h"
#include <signal.h>

typedef struct web_server web_server_t;

/** Most pages at one time. */
#define WEB_MOST_CLIENTS 8
/** Longest message from a page in bytes. */
#define WEB_MOST_MESSAGE 16384

typedef struct {
    /** Clients have numbers from 1 on that are never used again. */
    void (*opened)(void *context, unsigned long client);
    void (*closed)(void *context, unsigned long client);
    /** `text` ends with a zero byte after `length`. */
    void (*message)(void *context, unsigned long client, const char *text, size_t length);
    /** The file to answer "/TOKEN/file/NAME" with: false for 404. */
    bool (*file)(void *context, const char *name, char *path, size_t size, const char **type);
    /** "POST /TOKEN/upload/KEY" with so many bytes: false for 403. One at a time. */
    bool (*upload_begins)(void *context, const char *key, long bytes);
    /** The next of them. False: no more before web_server_upload_goes_on, but what is on the way. */
    bool (*upload_comes)(void *context, const void *part, size_t length);
    /** whole: no connection was lost on the way. */
    void (*upload_ends)(void *context, bool whole);
    void *context;
} web_handler_t;

/** port 0: one that is free. The handler must outlive the server. NULL on failure. */
web_server_t *web_server_open(int port, const web_handler_t *handler, failure_t *failure);
/** NULL is allowed. */
void web_server_close(web_server_t *server);

/** "http://127.0.0.1:PORT/TOKEN/". */
const char *web_server_address(const web_server_t *server);

/** Serves until *stop is not 0. */
bool web_server_run(web_server_t *server, const volatile sig_atomic_t *stop, failure_t *failure);

typedef enum {
    WEB_MUST,  /**< a client that does not take it is closed */
    WEB_LIVE,  /**< left out for a client that is slow: the next one comes */
    WEB_STREAM /**< left out for one that is slow for seconds: it sees that by the numbers of the frames */
} web_urgency_t;

/** To one client, or to all with 0. Any thread. */
void web_server_send(web_server_t *server, unsigned long client, const char *text, web_urgency_t urgency);

/** Any thread. */
void web_server_upload_goes_on(web_server_t *server);

#endif
