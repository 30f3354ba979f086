/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/web_server.h"
#include "serve_page_files.h" /* generated */
#include <libwebsockets.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Messages that wait for one client. Live ones are left out from the lower number on. */
#define MOST_WAITING        256
#define MOST_LIVE_WAITING   32
#define MOST_STREAM_WAITING 128
/* So that a page notices a server that has gone without a word. */
#define BEAT_S 1

typedef struct message message_t;
struct message {
    message_t *next;
    unsigned long client; /* 0: all */
    web_urgency_t urgency;
    size_t length;
    unsigned char text[]; /* LWS_PRE bytes, then the text */
};

typedef struct {
    message_t *first, **end;
    size_t count;
} queue_t;

typedef struct client client_t;
struct client {
    client_t *next;
    struct lws *wsi;
    unsigned long number;
    queue_t waiting;
    bool failed; /* too slow, or a message too long: to be closed */
    char received[WEB_MOST_MESSAGE + 1];
    size_t length;
};

struct web_server {
    const web_handler_t *handler;
    struct lws_context *context;
    int port;
    char token[ACCESS_TOKEN_LENGTH + 1];
    char address[100];
    client_t *clients;
    size_t count;
    unsigned long numbers;
    atomic_bool ready;   /* the context may be woken */
    struct lws *uploads; /* the connection on which a file comes, or NULL */
    atomic_bool goes_on; /* it may */
    pthread_mutex_t lock;
    queue_t sent; /* from any thread, under the lock */
    lws_sorted_usec_list_t beat;
};

/* What is left to send of a file of the page. */
typedef struct {
    const unsigned char *next;
    size_t left;
} transfer_t;

static void queue_clear(queue_t *queue) {
    *queue = (queue_t){.first = NULL, .end = &queue->first};
}

static void queue_put(queue_t *queue, message_t *message) {
    message->next = NULL;
    *queue->end = message;
    queue->end = &message->next;
    queue->count++;
}

static message_t *queue_take(queue_t *queue) {
    message_t *const message = queue->first;
    if (message != NULL) {
        queue->first = message->next;
        queue->end = queue->first == NULL ? &queue->first : queue->end;
        queue->count--;
    }
    return message;
}

static void queue_free(queue_t *queue) {
    for (message_t *message; (message = queue_take(queue)) != NULL;) {
        free(message);
    }
}

static message_t *message_make(const char *text, size_t length, unsigned long client, web_urgency_t urgency) {
    message_t *message = allocate(1, sizeof *message + LWS_PRE + length);
    message->client = client;
    message->urgency = urgency;
    message->length = length;
    memcpy(message->text + LWS_PRE, text, length);
    return message;
}

static void give(client_t *client, const message_t *message) {
    if ((message->urgency == WEB_LIVE && client->waiting.count >= MOST_LIVE_WAITING) ||
        (message->urgency == WEB_STREAM && client->waiting.count >= MOST_STREAM_WAITING)) {
        return;
    }
    if (client->waiting.count >= MOST_WAITING) {
        client->failed = true;
    } else {
        queue_put(&client->waiting, message_make((const char *)message->text + LWS_PRE, message->length, client->number,
                                                 message->urgency));
    }
    lws_callback_on_writable(client->wsi);
}

/* In the server's thread. */
static void deliver(web_server_t *server) {
    pthread_mutex_lock(&server->lock);
    queue_t sent = server->sent;
    if (sent.first == NULL) {
        sent.end = &sent.first;
    }
    queue_clear(&server->sent);
    pthread_mutex_unlock(&server->lock);
    for (message_t *message; (message = queue_take(&sent)) != NULL;) {
        for (client_t *client = server->clients; client != NULL; client = client->next) {
            if (message->client == 0 || message->client == client->number) {
                give(client, message);
            }
        }
        free(message);
    }
}

/* ---- Who may come in ---- */

static bool header(struct lws *wsi, enum lws_token_indexes which, char *text, size_t size) {
    text[0] = '\0';
    return lws_hdr_total_length(wsi, which) > 0 && lws_hdr_copy(wsi, text, (int)size, which) > 0;
}

/* An origin is needed for messages; a page that is opened has none. */
static bool allowed(const web_server_t *server, struct lws *wsi, bool needs_origin) {
    char host[100];
    char origin[100];
    const bool has_origin = lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) > 0;
    return header(wsi, WSI_TOKEN_HOST, host, sizeof host) && access_host_allowed(host, server->port) &&
           (has_origin
                ? header(wsi, WSI_TOKEN_ORIGIN, origin, sizeof origin) && access_origin_allowed(origin, server->port)
                : !needs_origin);
}

/* ---- HTTP ---- */

/* Nothing but what came with the page, from this server. */
#define PAGE_POLICY                                                                                                    \
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "              \
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
/* A report has its own style and may have its own script; it reaches nothing, not even this server. */
#define FILE_POLICY                                                                                                    \
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; sandbox allow-scripts"

/* Nothing but a status. */
static int answer(struct lws *wsi, unsigned status) {
    return lws_return_http_status(wsi, status, NULL) != 0 || lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

static bool add(struct lws *wsi, const char *name, const char *value, unsigned char **p, unsigned char *end) {
    return lws_add_http_header_by_name(wsi, (const unsigned char *)name, (const unsigned char *)value,
                                       (int)strlen(value), p, end) == 0;
}

static int begin_page_file(struct lws *wsi, transfer_t *transfer, const embedded_file_t *file) {
    unsigned char buffer[LWS_PRE + 2048];
    unsigned char *const start = buffer + LWS_PRE;
    unsigned char *p = start;
    unsigned char *const end = buffer + sizeof buffer - 1;
    if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, file->type, file->length, &p, end) != 0 ||
        !add(wsi, "content-security-policy:", PAGE_POLICY, &p, end) ||
        !add(wsi, "cache-control:", "no-store", &p, end) || !add(wsi, "referrer-policy:", "no-referrer", &p, end) ||
        !add(wsi, "x-content-type-options:", "nosniff", &p, end) ||
        lws_finalize_write_http_header(wsi, start, &p, end) != 0) {
        return -1;
    }
    *transfer = (transfer_t){file->data, file->length};
    lws_callback_on_writable(wsi);
    return 0;
}

static int go_on(struct lws *wsi, transfer_t *transfer) {
    unsigned char buffer[LWS_PRE + 8192];
    const size_t most = sizeof buffer - LWS_PRE;
    const size_t count = transfer->left < most ? transfer->left : most;
    const bool last = count == transfer->left;
    if (transfer->next == NULL) {
        return 0;
    }
    memcpy(buffer + LWS_PRE, transfer->next, count);
    if (lws_write(wsi, buffer + LWS_PRE, count, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) != (int)count) {
        return -1;
    }
    transfer->next += count;
    transfer->left -= count;
    if (!last) {
        lws_callback_on_writable(wsi);
        return 0;
    }
    transfer->next = NULL;
    return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

static int serve_file(const web_server_t *server, struct lws *wsi, const char *name) {
    static const char headers[] = "content-security-policy: " FILE_POLICY "\x0d\x0a"
                                  "cache-control: no-store\x0d\x0a"
                                  "referrer-policy: no-referrer\x0d\x0a"
                                  "x-content-type-options: nosniff\x0d\x0a";
    char path[4096];
    const char *type = NULL;
    if (!server->handler->file(server->handler->context, name, path, sizeof path, &type)) {
        return answer(wsi, HTTP_STATUS_NOT_FOUND);
    }
    const int result = lws_serve_http_file(wsi, path, type, headers, (int)strlen(headers));
    return result < 0 || (result > 0 && lws_http_transaction_completed(wsi) != 0) ? -1 : 0;
}

/* The body comes in parts (on_http). */
static int begin_upload(web_server_t *server, struct lws *wsi, const char *key) {
    char length[24];
    char *end = NULL;
    if (!allowed(server, wsi, true) || !header(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH, length, sizeof length)) {
        return answer(wsi, HTTP_STATUS_FORBIDDEN);
    }
    const long bytes = strtol(length, &end, 10);
    if (*end != '\0' || server->uploads != NULL ||
        !server->handler->upload_begins(server->handler->context, key, bytes)) {
        return answer(wsi, HTTP_STATUS_FORBIDDEN);
    }
    server->uploads = wsi;
    return 0;
}

static int take_upload(web_server_t *server, struct lws *wsi, const void *part, size_t length) {
    if (wsi != server->uploads) {
        return -1;
    }
    if (!server->handler->upload_comes(server->handler->context, part, length)) {
        (void)lws_rx_flow_control(wsi, 0);
    }
    return 0;
}

/* Whether this was the connection. */
static bool end_upload(web_server_t *server, const struct lws *wsi, bool whole) {
    if (wsi != server->uploads) {
        return false;
    }
    server->uploads = NULL;
    server->handler->upload_ends(server->handler->context, whole);
    return true;
}

static int serve(web_server_t *server, struct lws *wsi, transfer_t *transfer, const char *path) {
    static const char files[] = "file/";
    static const char upload[] = "upload/";
    if (!allowed(server, wsi, false)) {
        return answer(wsi, HTTP_STATUS_FORBIDDEN);
    }
    const char *const rest = access_rest_of_path(path, server->token);
    if (rest == NULL) {
        return answer(wsi, HTTP_STATUS_FORBIDDEN);
    }
    if (lws_hdr_total_length(wsi, WSI_TOKEN_POST_URI) > 0 && strncmp(rest, upload, strlen(upload)) == 0) {
        return begin_upload(server, wsi, rest + strlen(upload));
    }
    if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) <= 0) {
        return answer(wsi, HTTP_STATUS_METHOD_NOT_ALLOWED);
    }
    if (strncmp(rest, files, strlen(files)) == 0) {
        return serve_file(server, wsi, rest + strlen(files));
    }
    const char *const name = rest[0] == '\0' ? "page.html" : rest;
    for (size_t i = 0; i < serve_page_files_count; i++) {
        if (strcmp(name, serve_page_files[i].name) == 0) {
            return begin_page_file(wsi, transfer, &serve_page_files[i]);
        }
    }
    return answer(wsi, HTTP_STATUS_NOT_FOUND);
}

static int on_http(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t length) {
    web_server_t *const server = lws_context_user(lws_get_context(wsi));
    switch (reason) {
    case LWS_CALLBACK_HTTP:
        return serve(server, wsi, user, in);
    case LWS_CALLBACK_HTTP_WRITEABLE:
        return go_on(wsi, user);
    case LWS_CALLBACK_HTTP_BODY:
        return take_upload(server, wsi, in, length);
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
        return end_upload(server, wsi, true) ? answer(wsi, HTTP_STATUS_OK) : -1;
    case LWS_CALLBACK_CLOSED_HTTP:
        (void)end_upload(server, wsi, false);
        return 0;
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: /* messages without the name of their protocol */
        return -1;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
        deliver(server);
        if (atomic_exchange(&server->goes_on, false) && server->uploads != NULL) {
            (void)lws_rx_flow_control(server->uploads, 1);
        }
        return 0;
    default:
        return lws_callback_http_dummy(wsi, reason, user, in, length);
    }
}

/* ---- Messages ---- */

static int may_enter(const web_server_t *server, struct lws *wsi) {
    char path[200];
    const bool good = allowed(server, wsi, true) && header(wsi, WSI_TOKEN_GET_URI, path, sizeof path) &&
                      access_rest_of_path(path, server->token) != NULL && server->count < WEB_MOST_CLIENTS;
    if (!good) {
        (void)lws_return_http_status(wsi, HTTP_STATUS_FORBIDDEN, NULL);
    }
    return good ? 0 : -1;
}

static void enter(web_server_t *server, struct lws *wsi, client_t **place) {
    client_t *const client = allocate(1, sizeof *client);
    client->wsi = wsi;
    client->number = ++server->numbers;
    queue_clear(&client->waiting);
    client->next = server->clients;
    server->clients = client;
    server->count++;
    *place = client;
    server->handler->opened(server->handler->context, client->number);
}

static void leave(web_server_t *server, client_t **place) {
    client_t *const client = *place;
    if (client == NULL) {
        return;
    }
    for (client_t **link = &server->clients; *link != NULL; link = &(*link)->next) {
        if (*link == client) {
            *link = client->next;
            break;
        }
    }
    server->count--;
    *place = NULL;
    server->handler->closed(server->handler->context, client->number);
    queue_free(&client->waiting);
    free(client);
}

static int receive(web_server_t *server, struct lws *wsi, client_t *client, const char *part, size_t length) {
    if (client->length + length > WEB_MOST_MESSAGE || lws_frame_is_binary(wsi)) {
        lws_close_reason(wsi, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE, NULL, 0);
        return -1;
    }
    memcpy(client->received + client->length, part, length);
    client->length += length;
    if (lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0) {
        client->received[client->length] = '\0';
        const size_t whole = client->length;
        client->length = 0;
        server->handler->message(server->handler->context, client->number, client->received, whole);
    }
    return 0;
}

static int send_next(client_t *client) {
    if (client->failed) {
        return -1;
    }
    message_t *const message = queue_take(&client->waiting);
    if (message == NULL) {
        return 0;
    }
    const int written = lws_write(client->wsi, message->text + LWS_PRE, message->length, LWS_WRITE_TEXT);
    const bool good = written >= (int)message->length;
    free(message);
    if (client->waiting.first != NULL) {
        lws_callback_on_writable(client->wsi);
    }
    return good ? 0 : -1;
}

static int on_message(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t length) {
    web_server_t *const server = lws_context_user(lws_get_context(wsi));
    client_t **const place = user;
    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return may_enter(server, wsi);
    case LWS_CALLBACK_ESTABLISHED:
        enter(server, wsi, place);
        return 0;
    case LWS_CALLBACK_CLOSED:
        leave(server, place);
        return 0;
    case LWS_CALLBACK_RECEIVE:
        return *place != NULL ? receive(server, wsi, *place, in, length) : -1;
    case LWS_CALLBACK_SERVER_WRITEABLE:
        return *place != NULL ? send_next(*place) : 0;
    default:
        return 0;
    }
}

static const struct lws_protocols protocols[] = {
    {.name = "http", .callback = on_http, .per_session_data_size = sizeof(transfer_t)},
    {.name = "hyst", .callback = on_message, .per_session_data_size = sizeof(client_t *), .rx_buffer_size = 4096},
    {.name = NULL}};

static void beat(lws_sorted_usec_list_t *due) {
    web_server_t *const server = lws_container_of(due, web_server_t, beat);
    web_server_send(server, 0, "{\"event\": \"beat\"}", WEB_LIVE);
    lws_sul_schedule(server->context, 0, &server->beat, beat, BEAT_S * LWS_US_PER_SEC);
}

web_server_t *web_server_open(int port, const web_handler_t *handler, failure_t *failure) {
    web_server_t *server = allocate(1, sizeof *server);
    server->handler = handler;
    (void)pthread_mutex_init(&server->lock, NULL);
    queue_clear(&server->sent);
    atomic_init(&server->ready, false);
    atomic_init(&server->goes_on, false);
    if (!access_draw_token(server->token, failure)) {
        web_server_close(server);
        return NULL;
    }
    lws_set_log_level(0, NULL); /* it would print */
    const struct lws_context_creation_info info = {.port = CONTEXT_PORT_NO_LISTEN,
                                                   .options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS,
                                                   .gid = -1,
                                                   .uid = -1,
                                                   .user = server};
    const struct lws_context_creation_info listener = {
        .port = port, .iface = "127.0.0.1", .protocols = protocols, .options = LWS_SERVER_OPTION_DISABLE_IPV6};
    server->context = lws_create_context(&info);
    struct lws_vhost *const vhost = server->context != NULL ? lws_create_vhost(server->context, &listener) : NULL;
    server->port = vhost != NULL ? lws_get_vhost_listen_port(vhost) : 0;
    if (server->port <= 0) {
        (void)fail(failure, "cannot listen on port %d of 127.0.0.1: is it taken?", port);
        web_server_close(server);
        return NULL;
    }
    (void)snprintf(server->address, sizeof server->address, "http://127.0.0.1:%d/%s/", server->port, server->token);
    lws_sul_schedule(server->context, 0, &server->beat, beat, BEAT_S * LWS_US_PER_SEC);
    atomic_store(&server->ready, true);
    return server;
}

void web_server_close(web_server_t *server) {
    if (server == NULL) {
        return;
    }
    atomic_store(&server->ready, false);
    if (server->context != NULL) {
        lws_context_destroy(server->context);
    }
    queue_free(&server->sent);
    (void)pthread_mutex_destroy(&server->lock);
    free(server);
}

const char *web_server_address(const web_server_t *server) {
    return server->address;
}

bool web_server_run(web_server_t *server, const volatile sig_atomic_t *stop, failure_t *failure) {
    while (*stop == 0) {
        if (lws_service(server->context, 0) < 0) {
            return fail(failure, "the server's event loop has failed");
        }
    }
    return true;
}

static void wake(web_server_t *server) {
    if (atomic_load(&server->ready)) {
        lws_cancel_service(server->context);
    }
}

void web_server_upload_goes_on(web_server_t *server) {
    atomic_store(&server->goes_on, true);
    wake(server);
}

void web_server_send(web_server_t *server, unsigned long client, const char *text, web_urgency_t urgency) {
    message_t *message = message_make(text, strlen(text), client, urgency);
    pthread_mutex_lock(&server->lock);
    queue_put(&server->sent, message);
    pthread_mutex_unlock(&server->lock);
    wake(server);
}
