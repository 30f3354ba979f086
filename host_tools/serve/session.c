/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/session.h"
#include "base/json_output.h"
#include "base/monotonic_clock.h"
#include "base/progress.h"
#include "base/shown_name.h"
#include "serve/folder.h"
#include "serve/job_line.h"
#include "serve/line_keeper.h"
#include "serve/live.h"
#include "serve/message.h"
#include "serve/reader.h"
#include "serve/runs.h"
#include "serve/upload.h"
#include "serve/web_server.h"
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What is kept of the text of a job, for pages that come later. */
#define KEPT_TEXT ((size_t)1 << 17)

typedef struct {
    json_t *status; /* the event that a page which comes later gets; or NULL */
    double told_s;  /* when progress was last sent */
} activity_t;

struct session {
    const session_options_t *options;
    web_server_t *server;
    web_handler_t handler;
    line_listener_t listener;
    progress_listener_t progress;
    line_keeper_t *keeper;
    live_clock_t clock; /* the keeper's thread, and so the next */
    bool follows;
    unsigned long control; /* the client that has it, 0: none. The server's thread */
    unsigned long client[WEB_MOST_CLIENTS];
    size_t clients;
    job_t *job;
    /* Shared, under the lock. */
    pthread_mutex_t lock;
    json_t *line; /* the last event of this kind */
    activity_t run, job_activity;
    bool job_running;
    double sample_rate_hz;
    run_request_t request;                 /* of the run, while one runs */
    char made[JOB_LINE_MADE][FOLDER_NAME]; /* by the job, if it succeeds */
    reader_t *reader;
    reader_listener_t reader_listener;
    upload_t *upload;
    upload_listener_t upload_listener;
};

/* ---- To the pages ---- */

/* What a user named or a failure says goes through json_text: it may be cut within a character. */
static void tell(session_t *session, unsigned long client, json_t *event, web_urgency_t urgency) {
    char *text = json_dumps(event, JSON_COMPACT | JSON_REAL_PRECISION(9));
    if (text != NULL) {
        web_server_send(session->server, client, text, urgency);
    }
    free(text);
    json_decref(event);
}

static void refuse(session_t *session, unsigned long client, const char *what, const failure_t *failure) {
    tell(session, client,
         json_pack("{s:s, s:o, s:o}", "event", "refused", "do", json_text(what), "why", json_text(failure->text)),
         WEB_MUST);
}

static json_t *files_event(const session_t *session) {
    failure_t failure;
    json_t *list = folder_list(session->options->folder, &failure);
    return list != NULL ? json_pack("{s:s, s:o}", "event", "files", "files", list)
                        : json_pack("{s:s, s:[], s:o}", "event", "files", "files", "why", json_text(failure.text));
}

/* Keeps the event for pages that come later, and sends it. */
static void keep_and_tell(session_t *session, json_t **kept, json_t *event) {
    pthread_mutex_lock(&session->lock);
    json_decref(*kept);
    *kept = json_deep_copy(event);
    pthread_mutex_unlock(&session->lock);
    tell(session, 0, event, WEB_MUST);
}

/* ---- The line (in the keeper's thread) ---- */

static void on_line(void *context, const device_t *device, const hyst_parameters_t *image, const char *why) {
    session_t *const session = context;
    if (device != NULL) {
        pthread_mutex_lock(&session->lock);
        session->sample_rate_hz = device_sample_rate_hz(device);
        pthread_mutex_unlock(&session->lock);
    }
    session->options->line_changed(session->options->context, why);
    keep_and_tell(session, &session->line, live_line(session->options->line.port, device, image, why));
}

static void on_snapshot(void *context, const device_t *device, const hyst_parameters_t *image,
                        const int64_t now[REGISTER_COUNT]) {
    session_t *const session = context;
    session->follows = live_follows(now);
    tell(session, 0, live_snapshot(&session->clock, now, image, device_sample_rate_hz(device)), WEB_LIVE);
}

static void on_stream(void *context, const device_t *device, const hyst_parameters_t *image,
                      const stream_block_t *block) {
    session_t *const session = context;
    tell(session, 0, live_stream(&session->clock, block, session->follows, image, device_sample_rate_hz(device)),
         WEB_STREAM);
}

static void on_stopped(void *context, double seconds, const char *why) {
    tell(context, 0, json_pack("{s:s, s:f, s:o}", "event", "stopped", "seconds", seconds, "why", json_text(why)),
         WEB_MUST);
}

/* Progress of the run: its thread is the keeper's. */
static void on_progress(void *context, const char *what, double fraction) {
    session_t *const session = context;
    pthread_mutex_lock(&session->lock);
    json_t *const status = session->run.status;
    const bool due = status != NULL && monotonic_s() - session->run.told_s > 0.1;
    json_t *event = NULL;
    if (due) {
        session->run.told_s = monotonic_s();
        json_object_set_new(status, "what", json_text(what));
        json_object_set_new(status, "fraction", json_real(fraction));
        event = json_deep_copy(status);
    }
    pthread_mutex_unlock(&session->lock);
    if (event != NULL) {
        tell(session, 0, event, WEB_LIVE);
    }
}

static void on_progress_begin(void *context, const char *what) {
    on_progress(context, what, 0.0);
}

static void on_progress_end(void *context, const char *what) {
    (void)context;
    (void)what;
}

static const char *const run_names[] = {"record", "track", "push", "clear"};

static json_t *made_json(char path[2][RUNS_PATH], size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(list, json_text(without_folder(path[i])));
    }
    return list;
}

static void on_run_ended(void *context, bool good, const failure_t *failure) {
    session_t *const session = context;
    run_request_t *const r = &session->request;
    const size_t written = r->kind == RUN_RECORD ? 1 : r->kind == RUN_TRACK ? (size_t)r->before + (size_t)r->after : 0;
    json_t *event =
        json_pack("{s:s, s:s, s:b, s:b, s:o, s:o, s:o, s:o}", "event", "run", "name", run_names[r->kind], "running",
                  false, "good", good, "why", json_text(good ? NULL : failure->text), "note",
                  json_text(r->left.text[0] != '\0' ? r->left.text : NULL), "made",
                  made_json(r->path, good ? written : 0), "result", r->result != NULL ? r->result : json_null());
    r->result = NULL;
    keep_and_tell(session, &session->run.status, event);
    tell(session, 0, files_event(session), WEB_MUST);
}

/* ---- Runs of the amplifier ---- */

/* Fills request->path. */
static bool run_files(const session_t *session, json_t *message, run_request_t *request, failure_t *failure) {
    char text[256] = "";
    char name[2][256];
    if (request->kind == RUN_PUSH) {
        return message_text(message, "image", text, sizeof text, failure) &&
               folder_file(session->options->folder, text, FILE_IMAGE_KIND, request->path[0], failure);
    }
    if (request->kind == RUN_CLEAR) {
        return true;
    }
    (void)snprintf(text, sizeof text, "%s", run_names[request->kind]);
    if (!message_text(message, "name", text, sizeof text, failure)) {
        return false;
    }
    static const char *const one[] = {".csv"};
    static const char *const two[] = {"-linear.csv", "-compensate.csv"};
    const bool track = request->kind == RUN_TRACK;
    const char *const *const suffix = !track ? one : request->before ? two : two + 1;
    const size_t count = track ? (size_t)request->before + (size_t)request->after : 1;
    bool ok = folder_free_names(session->options->folder, text, suffix, count, name, failure);
    for (size_t i = 0; ok && i < count; i++) {
        ok = folder_path(session->options->folder, name[i], request->path[i], failure);
    }
    return ok;
}

static bool carry_out(line_keeper_t *keeper, device_t *device, void *context, failure_t *failure) {
    session_t *const session = context;
    return run_request_carry_out(keeper, device, &session->request, failure);
}

static bool begin_run(session_t *session, run_kind_t kind, json_t *message, failure_t *failure) {
    run_request_t request = {.kind = kind};
    if (!run_request_read(message, &request, failure) || !run_files(session, message, &request, failure)) {
        return false;
    }
    pthread_mutex_lock(&session->lock);
    const bool busy = session->run.status != NULL && json_is_true(json_object_get(session->run.status, "running"));
    if (!busy) {
        session->request = request;
        json_decref(session->run.status);
        session->run.status = json_pack("{s:s, s:s, s:b}", "event", "run", "name", run_names[kind], "running", true);
        session->run.told_s = 0.0;
    }
    json_t *const event = busy ? NULL : json_deep_copy(session->run.status);
    pthread_mutex_unlock(&session->lock);
    if (busy) {
        return fail(failure, "the amplifier is busy: wait for it, or press Stop");
    }
    tell(session, 0, event, WEB_MUST);
    const line_work_t work = {carry_out, on_run_ended, session};
    if (!line_keeper_give(session->keeper, &work, failure)) {
        keep_and_tell(session, &session->run.status,
                      json_pack("{s:s, s:s, s:b}", "event", "run", "name", run_names[kind], "running", false));
        return false;
    }
    return true;
}

/* ---- Jobs ---- */

/* In the job's thread. */
static void on_job_line(void *context, const char *line) {
    session_t *const session = context;
    pthread_mutex_lock(&session->lock);
    json_t *const status = session->job_activity.status;
    const char *const before = json_string_value(json_object_get(status, "text"));
    json_t *const text = json_text(line);
    const char *const valid = json_string_value(text);
    if (before != NULL && strlen(before) + strlen(valid) < KEPT_TEXT) {
        json_object_set_new(status, "text", json_sprintf("%s%s\n", before, valid));
    }
    pthread_mutex_unlock(&session->lock);
    tell(session, 0, json_pack("{s:s, s:o}", "event", "job_line", "line", text), WEB_MUST);
}

static void on_job_progress(void *context, const char *what, double fraction) {
    tell(context, 0,
         json_pack("{s:s, s:o, s:f}", "event", "job_progress", "what", json_text(what), "fraction", fraction),
         WEB_LIVE);
}

static void on_job_ended(void *context, int status) {
    session_t *const session = context;
    json_t *const made = json_array();
    pthread_mutex_lock(&session->lock);
    for (size_t i = 0; status == 0 && i < JOB_LINE_MADE && session->made[i][0] != '\0'; i++) {
        json_array_append_new(made, json_string(session->made[i]));
    }
    json_t *const kept = session->job_activity.status;
    json_object_set_new(kept, "running", json_false());
    json_object_set_new(kept, "good", json_boolean(status == 0));
    json_object_set_new(kept, "cancelled", json_boolean(status < 0));
    json_object_set_new(kept, "made", made);
    json_t *const event = json_deep_copy(kept);
    session->job_running = false;
    pthread_mutex_unlock(&session->lock);
    tell(session, 0, event, WEB_MUST);
    tell(session, 0, files_event(session), WEB_MUST);
}

static bool begin_job(session_t *session, const char *name, json_t *message, failure_t *failure) {
    pthread_mutex_lock(&session->lock);
    const bool busy = session->job_running;
    const double sample_rate_hz = session->sample_rate_hz;
    pthread_mutex_unlock(&session->lock);
    if (busy) {
        return fail(failure, "another computation runs: wait for it, or cancel it");
    }
    job_end(session->job); /* the one before, which has ended */
    session->job = NULL;
    job_line_t *const line = job_line_read(name, message, session->options->folder, sample_rate_hz, failure);
    bool ok = line != NULL;
    if (ok) {
        memcpy(session->made, line->made, sizeof session->made);
        json_t *const status =
            json_pack("{s:s, s:s, s:b, s:s}", "event", "job", "name", name, "running", true, "text", "");
        pthread_mutex_lock(&session->lock);
        session->job_running = true;
        pthread_mutex_unlock(&session->lock);
        keep_and_tell(session, &session->job_activity.status, status);
        const job_listener_t listener = {on_job_line, on_job_progress, on_job_ended, session};
        session->job = job_start(line->argument, &listener, failure);
        ok = session->job != NULL;
        if (!ok) {
            on_job_ended(session, 1);
        }
    }
    free(line);
    return ok;
}

/* ---- Recordings to look at (in the reader's thread) ---- */

static void on_read(void *context, unsigned long client, json_t *recording, const failure_t *why) {
    if (recording == NULL) {
        refuse(context, client, "show", why);
    } else {
        json_object_set_new(recording, "event", json_string("recording"));
        tell(context, client, recording, WEB_MUST);
    }
}

static bool show(session_t *session, unsigned long client, json_t *message, failure_t *failure) {
    char name[FOLDER_NAME] = "";
    return message_text(message, "name", name, sizeof name, failure) &&
           reader_want(session->reader, client, name, failure);
}

/* ---- Files from a page ---- */

/* In the upload's thread, and the next. */
static void on_room(void *context) {
    const session_t *const session = context;
    web_server_upload_goes_on(session->server);
}

static void on_uploaded(void *context, const char *name, bool good, const failure_t *why) {
    session_t *const session = context;
    if (good) { /* first, so that the page has it in its lists */
        tell(session, 0, files_event(session), WEB_MUST);
    }
    tell(session, 0,
         json_pack("{s:s, s:s, s:b, s:o}", "event", "uploaded", "name", name, "good", good, "why",
                   json_text(good ? NULL : why->text)),
         WEB_MUST);
}

static bool announce(session_t *session, unsigned long client, json_t *message, failure_t *failure) {
    char wished[1024] = "";
    char name[1][FOLDER_NAME];
    char key[ACCESS_TOKEN_LENGTH + 1];
    double bytes = 0.0; /* more than a count has */
    if (!message_text(message, "name", wished, sizeof wished, failure) ||
        !message_number(message, "bytes", &bytes, failure) ||
        !upload_announce(session->upload, client, wished, bytes < 1e15 ? (long)bytes : LONG_MAX, name, key, failure)) {
        return false;
    }
    tell(session, client, json_pack("{s:s, s:s, s:s+}", "event", "upload", "name", name[0], "to", "upload/", key),
         WEB_MUST);
    return true;
}

static bool on_upload_begins(void *context, const char *key, long bytes) {
    const session_t *const session = context;
    return upload_begin(session->upload, key, bytes);
}

static bool on_upload_comes(void *context, const void *part, size_t length) {
    const session_t *const session = context;
    return upload_give(session->upload, part, length);
}

static void on_upload_ends(void *context, bool whole) {
    const session_t *const session = context;
    if (session->upload != NULL) {
        upload_finish(session->upload, whole);
    }
}

/* ---- From the pages (in the server's thread) ---- */

static json_t *role(const session_t *session, unsigned long client) {
    return json_pack("{s:s, s:b, s:b}", "event", "role", "control", session->control == client, "free",
                     session->control == 0);
}

static void tell_roles(session_t *session) {
    for (size_t i = 0; i < session->clients; i++) {
        tell(session, session->client[i], role(session, session->client[i]), WEB_MUST);
    }
}

static void on_opened(void *context, unsigned long client) {
    session_t *const session = context;
    const session_options_t *const o = session->options;
    session->client[session->clients++] = client;
    line_keeper_watch(session->keeper, true);
    if (session->control == 0) {
        session->control = client;
    }
    tell(session, client,
         json_pack("{s:s, s:s, s:o, s:b, s:[ff], s:[ff]}", "event", "hello", "version", HYST_VERSION, "folder",
                   json_text(o->folder), "simulated", o->simulated, "drive_range", o->drive_range_v[0],
                   o->drive_range_v[1], "position_range", o->position_range_um[0], o->position_range_um[1]),
         WEB_MUST);
    tell_roles(session);
    pthread_mutex_lock(&session->lock);
    json_t *const kept[] = {json_deep_copy(session->line), json_deep_copy(session->run.status),
                            json_deep_copy(session->job_activity.status)};
    pthread_mutex_unlock(&session->lock);
    for (size_t i = 0; i < sizeof kept / sizeof kept[0]; i++) {
        if (kept[i] != NULL) {
            tell(session, client, kept[i], WEB_MUST);
        }
    }
    tell(session, client, files_event(session), WEB_MUST);
}

static void on_closed(void *context, unsigned long client) {
    session_t *const session = context;
    for (size_t i = 0; i < session->clients; i++) {
        if (session->client[i] == client) {
            session->client[i] = session->client[--session->clients];
            break;
        }
    }
    if (session->control == client) {
        session->control = 0;
    }
    if (session->upload != NULL) { /* which ends before the pages do, as the next */
        upload_withdraw(session->upload, client);
    }
    if (session->keeper != NULL) {
        line_keeper_watch(session->keeper, session->clients > 0);
    }
    tell_roles(session);
}

static bool control(session_t *session, unsigned long client, const char *what, json_t *message, failure_t *failure) {
    for (size_t i = 0; i < sizeof run_names / sizeof run_names[0]; i++) {
        if (strcmp(what, run_names[i]) == 0) {
            return begin_run(session, (run_kind_t)i, message, failure);
        }
    }
    if (job_line_knows(what)) {
        return begin_job(session, what, message, failure);
    }
    if (strcmp(what, "upload") == 0) {
        return announce(session, client, message, failure);
    }
    if (strcmp(what, "cancel") == 0) {
        if (session->job != NULL) {
            job_cancel(session->job);
        }
        return true;
    }
    return fail(failure, "unknown: '%.50s'", what);
}

static bool obey(session_t *session, unsigned long client, const char *what, json_t *message, failure_t *failure) {
    if (strcmp(what, "stop") == 0) {
        line_keeper_stop(session->keeper);
        tell(session, 0, json_pack("{s:s}", "event", "stopping"), WEB_MUST);
        return true;
    }
    if (strcmp(what, "show") == 0) {
        return show(session, client, message, failure);
    }
    if (strcmp(what, "take") == 0 && session->control == 0) {
        session->control = client;
        tell_roles(session);
        return true;
    }
    return session->control == client ? control(session, client, what, message, failure)
                                      : fail(failure, "another page has control: this one may watch, and stop");
}

static void on_message(void *context, unsigned long client, const char *text, size_t length) {
    session_t *const session = context;
    failure_t failure = {0};
    json_t *const message = json_loadb(text, length, JSON_REJECT_DUPLICATES, NULL);
    const char *const what = json_string_value(json_object_get(message, "do"));
    if (what == NULL) {
        (void)fail(&failure, "not a message of this page");
        refuse(session, client, "", &failure);
    } else if (!obey(session, client, what, message, &failure)) {
        refuse(session, client, what, &failure);
    }
    json_decref(message);
}

static bool on_file(void *context, const char *name, char *path, size_t size, const char **type) {
    const session_t *const session = context;
    char found[FOLDER_PATH];
    failure_t ignored;
    const file_kind_t kind = folder_kind(session->options->folder, name);
    *type = folder_type(name);
    return kind != FILE_OTHER && kind != FILE_MEASUREMENTS_KIND && /* which may be imported, and are not given out */
           folder_path(session->options->folder, name, found, &ignored) &&
           snprintf(path, size, "%s", found) < (int)size;
}

/* ---- Begin and end ---- */

session_t *session_open(const session_options_t *options, failure_t *failure) {
    session_t *session = allocate(1, sizeof *session);
    session->options = options;
    (void)pthread_mutex_init(&session->lock, NULL);
    json_t *const list = folder_list(options->folder, failure);
    if (list == NULL) {
        free(session);
        return NULL;
    }
    json_decref(list);
    session->handler = (web_handler_t){on_opened,        on_closed,       on_message,     on_file,
                                       on_upload_begins, on_upload_comes, on_upload_ends, session};
    session->listener = (line_listener_t){on_line, on_snapshot, on_stream, on_stopped, session};
    session->progress = (progress_listener_t){on_progress_begin, on_progress, on_progress_end, session};
    session->server = web_server_open(options->port, &session->handler, failure);
    if (session->server == NULL) {
        free(session);
        return NULL;
    }
    progress_listen(&session->progress);
    session->reader_listener = (reader_listener_t){on_read, session};
    session->upload_listener = (upload_listener_t){on_room, on_uploaded, session};
    session->reader = reader_start(options->folder, &session->reader_listener, failure);
    session->upload =
        session->reader != NULL ? upload_start(options->folder, &session->upload_listener, failure) : NULL;
    session->keeper = session->upload != NULL ? line_keeper_start(&options->line, &session->listener, failure) : NULL;
    if (session->keeper == NULL) {
        session_close(session);
        return NULL;
    }
    return session;
}

void session_close(session_t *session) {
    if (session == NULL) {
        return;
    }
    line_keeper_end(session->keeper); /* first: it may have to park */
    session->keeper = NULL;
    if (session->job != NULL) {
        job_cancel(session->job);
        job_end(session->job);
    }
    reader_end(session->reader);
    upload_end(session->upload);
    session->upload = NULL;
    progress_listen(NULL);
    /* Its last callbacks use the rest. */
    web_server_close(session->server);
    json_decref(session->line);
    json_decref(session->run.status);
    json_decref(session->job_activity.status);
    (void)pthread_mutex_destroy(&session->lock);
    free(session);
}

const char *session_address(const session_t *session) {
    return web_server_address(session->server);
}

bool session_run(session_t *session, const volatile sig_atomic_t *stop, failure_t *failure) {
    return web_server_run(session->server, stop, failure);
}
