/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "serve/session.h"
#include "base/monotonic_clock.h"
#include "base/progress.h"
#include "serve/folder.h"
#include "serve/job.h"
#include "serve/line_keeper.h"
#include "serve/live.h"
#include "serve/message.h"
#include "serve/runs.h"
#include "serve/web_server.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Samples of a recording that a page gets. */
#define SHOWN_SAMPLES 4000
/* What is kept of the text of a job, for pages that come later. */
#define KEPT_TEXT ((size_t)1 << 17)
/* Numbers behind the name of a file, until there is a free one. */
#define MOST_NUMBER 10000

/* A recording that a page wants to see; reading it takes time. */
typedef struct wish wish_t;
struct wish {
    wish_t *next;
    unsigned long client;
    char name[FOLDER_PATH];
};

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
    live_clock_t clock;    /* the keeper's thread */
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
    run_request_t request; /* of the run, while one runs */
    char made[2][256];     /* names of the files that the job, if it succeeds, has made */
    /* The reader. */
    pthread_t reader;
    pthread_cond_t wished;
    wish_t *wishes;
    bool ending;
};

/* ---- To the pages ---- */

static void tell(session_t *session, unsigned long client, json_t *event, web_urgency_t urgency) {
    char *text = json_dumps(event, JSON_COMPACT | JSON_REAL_PRECISION(9));
    if (text != NULL) {
        web_server_send(session->server, client, text, urgency);
    }
    free(text);
    json_decref(event);
}

static void refuse(session_t *session, unsigned long client, const char *what, const failure_t *failure) {
    tell(session, client, json_pack("{s:s, s:s, s:s}", "event", "refused", "do", what, "why", failure->text), WEB_MUST);
}

static json_t *files_event(const session_t *session) {
    failure_t failure;
    json_t *list = folder_list(session->options->folder, &failure);
    return list != NULL ? json_pack("{s:s, s:o}", "event", "files", "files", list)
                        : json_pack("{s:s, s:[], s:s}", "event", "files", "files", "why", failure.text);
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
    keep_and_tell(session, &session->line, live_line(session->options->line.port, device, image, why));
}

static void on_snapshot(void *context, const device_t *device, const hyst_parameters_t *image,
                        const int64_t now[REGISTER_COUNT]) {
    session_t *const session = context;
    tell(session, 0, live_snapshot(&session->clock, now, image, device_sample_rate_hz(device)), WEB_LIVE);
}

static void on_stopped(void *context, double seconds, const char *why) {
    tell(context, 0, json_pack("{s:s, s:f, s:s?}", "event", "stopped", "seconds", seconds, "why", why), WEB_MUST);
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
        json_object_set_new(status, "what", json_string(what));
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
        const char *const slash = strrchr(path[i], '/');
        json_array_append_new(list, json_string(slash != NULL ? slash + 1 : path[i]));
    }
    return list;
}

static void on_run_ended(void *context, bool good, const failure_t *failure) {
    session_t *const session = context;
    run_request_t *const r = &session->request;
    const size_t written = r->kind == RUN_RECORD ? 1 : r->kind == RUN_TRACK ? (size_t)r->before + (size_t)r->after : 0;
    json_t *event =
        json_pack("{s:s, s:s, s:b, s:b, s:s?, s:o, s:o}", "event", "run", "name", run_names[r->kind], "running", false,
                  "good", good, "why", good ? NULL : failure->text, "made", made_json(r->path, good ? written : 0),
                  "result", r->result != NULL ? r->result : json_null());
    r->result = NULL;
    keep_and_tell(session, &session->run.status, event);
    tell(session, 0, files_event(session), WEB_MUST);
}

/* ---- Names of files ---- */

static bool is_free(const session_t *session, const char *name, char path[FOLDER_PATH], failure_t *failure) {
    return folder_path(session->options->folder, name, path, failure) &&
           (access(path, F_OK) != 0 || fail(failure, "%s exists", name));
}

/* "STEM.csv", or "STEM-2.csv" and so on: the first with which all suffixes are free. */
static bool free_names(const session_t *session, const char *stem, const char *const suffix[], size_t count,
                       char name[][256], failure_t *failure) {
    char path[FOLDER_PATH];
    if (strlen(stem) > 100 || !folder_path(session->options->folder, stem, path, failure)) {
        return fail(failure, "'%.100s': a name has at most 100 letters, digits, '-', '_' and '.'", stem);
    }
    for (int number = 1; number < MOST_NUMBER; number++) {
        bool all = true;
        for (size_t i = 0; all && i < count; i++) {
            (void)(number == 1 ? snprintf(name[i], 256, "%s%s", stem, suffix[i])
                               : snprintf(name[i], 256, "%s-%d%s", stem, number, suffix[i]));
            all = is_free(session, name[i], path, failure);
        }
        if (all) {
            return true;
        }
    }
    return fail(failure, "%s: all numbers behind this name are taken", stem);
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
    bool ok = free_names(session, text, suffix, count, name, failure);
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

typedef struct {
    const char *argument[JOB_ARGUMENTS];
    char text[JOB_ARGUMENTS][FOLDER_PATH]; /* what the arguments point to, where they are no constants */
    size_t count;
} job_line_t;

static void argue(job_line_t *line, const char *constant) {
    if (line->count + 1 < JOB_ARGUMENTS) {
        line->argument[line->count++] = constant;
    }
}

static char *room(job_line_t *line) {
    char *const text = line->text[line->count];
    argue(line, text);
    return text;
}

/* The member `key` names an existing file. */
static bool argue_file(const session_t *session, job_line_t *line, json_t *message, const char *key, file_kind_t kind,
                       failure_t *failure) {
    char name[256] = "";
    return message_text(message, key, name, sizeof name, failure) &&
           folder_file(session->options->folder, name, kind, room(line), failure);
}

/* The member "recordings" names one or several. */
static bool argue_recordings(const session_t *session, job_line_t *line, json_t *message, failure_t *failure) {
    static const size_t most = 8;
    json_t *const list = json_object_get(message, "recordings");
    const size_t count = json_array_size(list);
    if (count < 1 || count > most) {
        return fail(failure, "recordings: from one to %zu names", most);
    }
    for (size_t i = 0; i < count; i++) {
        const char *const name = json_string_value(json_array_get(list, i));
        if (name == NULL) {
            return fail(failure, "recordings: not names");
        }
        if (!folder_file(session->options->folder, name, FILE_RECORDING_KIND, room(line), failure)) {
            return false;
        }
    }
    return true;
}

static bool argue_output(session_t *session, job_line_t *line, const char *option, size_t which, failure_t *failure) {
    argue(line, option);
    return folder_path(session->options->folder, session->made[which], room(line), failure);
}

static bool fit_line(session_t *session, job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".json"};
    char family[64] = "";
    bool creep = false;
    argue(line, "fit");
    if (!argue_recordings(session, line, message, failure) ||
        !message_text(message, "family", family, sizeof family, failure) ||
        !message_flag(message, "creep", &creep, failure) ||
        !free_names(session, "model", suffix, 1, session->made, failure) ||
        !argue_output(session, line, "-o", 0, failure)) {
        return false;
    }
    if (family[0] != '\0') {
        argue(line, "--family");
        (void)snprintf(room(line), FOLDER_PATH, "%s", family);
    }
    if (creep) {
        argue(line, "--creep");
    }
    return true;
}

static bool diagnose_line(session_t *session, job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".html", ".json"};
    argue(line, "diagnose");
    if (!argue_recordings(session, line, message, failure) ||
        !free_names(session, "diagnosis", suffix, 2, session->made, failure) ||
        !argue_output(session, line, "--report", 0, failure) || !argue_output(session, line, "-o", 1, failure)) {
        return false;
    }
    if (json_object_get(message, "model") == NULL) {
        return true;
    }
    argue(line, "--model");
    return argue_file(session, line, message, "model", FILE_MODEL_KIND, failure);
}

static bool compile_line(session_t *session, job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".image"};
    char model[256] = "";
    char stem[256];
    argue(line, "compile");
    if (!argue_file(session, line, message, "model", FILE_MODEL_KIND, failure) ||
        !message_text(message, "model", model, sizeof model, failure)) {
        return false;
    }
    (void)snprintf(stem, sizeof stem, "%.*s", (int)(strlen(model) - strlen(".json")), model);
    if (!free_names(session, stem, suffix, 1, session->made, failure) ||
        !argue_output(session, line, "-o", 0, failure)) {
        return false;
    }
    pthread_mutex_lock(&session->lock);
    const double rate_hz = session->sample_rate_hz;
    pthread_mutex_unlock(&session->lock);
    if (rate_hz > 0.0) {
        argue(line, "--sample-rate");
        (void)snprintf(room(line), FOLDER_PATH, "%.9g", rate_hz);
    }
    return true;
}

static bool look_line(session_t *session, job_line_t *line, json_t *message, failure_t *failure) {
    argue(line, "look");
    return argue_recordings(session, line, message, failure);
}

static bool simulate_line(session_t *session, job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".csv"};
    argue(line, "simulate");
    return argue_file(session, line, message, "model", FILE_MODEL_KIND, failure) &&
           argue_file(session, line, message, "recording", FILE_RECORDING_KIND, failure) &&
           free_names(session, "simulated", suffix, 1, session->made, failure) &&
           argue_output(session, line, "-o", 0, failure);
}

static bool report_line(session_t *session, job_line_t *line, json_t *message, failure_t *failure) {
    static const char *const suffix[] = {".html"};
    char name[2][256] = {"", ""};
    char path[2][FOLDER_PATH];
    argue(line, "report");
    if (!argue_file(session, line, message, "model", FILE_MODEL_KIND, failure) ||
        !argue_file(session, line, message, "recording", FILE_RECORDING_KIND, failure) ||
        !message_text(message, "before", name[0], sizeof name[0], failure) ||
        !message_text(message, "after", name[1], sizeof name[1], failure) ||
        !folder_file(session->options->folder, name[0], FILE_RECORDING_KIND, path[0], failure) ||
        !folder_file(session->options->folder, name[1], FILE_RECORDING_KIND, path[1], failure)) {
        return false;
    }
    const int length = snprintf(room(line), FOLDER_PATH, "track=%s,%s", path[0], path[1]);
    return (length < FOLDER_PATH || fail(failure, "%s: name too long", name[0])) &&
           free_names(session, "report", suffix, 1, session->made, failure) &&
           argue_output(session, line, "-o", 0, failure);
}

static const struct {
    const char *name;
    bool (*line)(session_t *session, job_line_t *line, json_t *message, failure_t *failure);
} job_kinds[] = {{"fit", fit_line},   {"diagnose", diagnose_line}, {"compile", compile_line},
                 {"look", look_line}, {"simulate", simulate_line}, {"report", report_line}};

/* In the job's thread. */
static void on_job_line(void *context, const char *line) {
    session_t *const session = context;
    pthread_mutex_lock(&session->lock);
    json_t *const status = session->job_activity.status;
    const char *const before = json_string_value(json_object_get(status, "text"));
    if (before != NULL && strlen(before) + strlen(line) < KEPT_TEXT) {
        json_object_set_new(status, "text", json_sprintf("%s%s\n", before, line));
    }
    pthread_mutex_unlock(&session->lock);
    json_t *const event = json_pack("{s:s, s:s}", "event", "job_line", "line", line);
    if (event != NULL) { /* NULL: not UTF-8 */
        tell(session, 0, event, WEB_MUST);
    }
}

static void on_job_progress(void *context, const char *what, double fraction) {
    tell(context, 0, json_pack("{s:s, s:s, s:f}", "event", "job_progress", "what", what, "fraction", fraction),
         WEB_LIVE);
}

static void on_job_ended(void *context, int status) {
    session_t *const session = context;
    json_t *const made = json_array();
    pthread_mutex_lock(&session->lock);
    for (size_t i = 0; status == 0 && i < 2 && session->made[i][0] != '\0'; i++) {
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

static bool begin_job(session_t *session, size_t kind, json_t *message, failure_t *failure) {
    pthread_mutex_lock(&session->lock);
    const bool busy = session->job_running;
    pthread_mutex_unlock(&session->lock);
    if (busy) {
        return fail(failure, "another computation runs: wait for it, or cancel it");
    }
    job_end(session->job); /* the one before, which has ended */
    session->job = NULL;
    session->made[0][0] = session->made[1][0] = '\0';
    job_line_t *const line = allocate(1, sizeof *line);
    bool ok = job_kinds[kind].line(session, line, message, failure);
    if (ok) {
        json_t *const status = json_pack("{s:s, s:s, s:b, s:s}", "event", "job", "name", job_kinds[kind].name,
                                         "running", true, "text", "");
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

/* ---- Recordings to look at ---- */

static void *read_wishes(void *context) {
    session_t *const session = context;
    pthread_mutex_lock(&session->lock);
    while (!session->ending) {
        wish_t *const wish = session->wishes;
        if (wish == NULL) {
            pthread_cond_wait(&session->wished, &session->lock);
            continue;
        }
        session->wishes = wish->next;
        pthread_mutex_unlock(&session->lock);
        failure_t failure;
        json_t *const recording = folder_recording(session->options->folder, wish->name, SHOWN_SAMPLES, &failure);
        if (recording == NULL) {
            refuse(session, wish->client, "show", &failure);
        } else {
            json_object_set_new(recording, "event", json_string("recording"));
            tell(session, wish->client, recording, WEB_MUST);
        }
        free(wish);
        pthread_mutex_lock(&session->lock);
    }
    pthread_mutex_unlock(&session->lock);
    return NULL;
}

static bool show(session_t *session, unsigned long client, json_t *message, failure_t *failure) {
    static const size_t most = 32; /* waiting */
    char path[FOLDER_PATH];
    wish_t *wish = allocate(1, sizeof *wish);
    wish->client = client;
    if (!message_text(message, "name", wish->name, sizeof wish->name, failure) ||
        !folder_file(session->options->folder, wish->name, FILE_RECORDING_KIND, path, failure)) {
        free(wish);
        return false;
    }
    size_t waiting = 0;
    pthread_mutex_lock(&session->lock);
    wish_t **end = &session->wishes;
    for (; *end != NULL; end = &(*end)->next) {
        waiting++;
    }
    const bool room = waiting < most;
    if (room) {
        *end = wish;
        pthread_cond_signal(&session->wished);
    }
    pthread_mutex_unlock(&session->lock);
    if (!room) {
        free(wish);
        return fail(failure, "too many recordings at once");
    }
    return true;
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
    if (session->control == 0) {
        session->control = client;
    }
    tell(session, client,
         json_pack("{s:s, s:s, s:s, s:b, s:[ff], s:[ff]}", "event", "hello", "version", HYST_VERSION, "folder",
                   o->folder, "simulated", o->simulated, "drive_range", o->drive_range_v[0], o->drive_range_v[1],
                   "position_range", o->position_range_um[0], o->position_range_um[1]),
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
    tell_roles(session);
}

static bool control(session_t *session, const char *what, json_t *message, failure_t *failure) {
    for (size_t i = 0; i < sizeof run_names / sizeof run_names[0]; i++) {
        if (strcmp(what, run_names[i]) == 0) {
            return begin_run(session, (run_kind_t)i, message, failure);
        }
    }
    for (size_t i = 0; i < sizeof job_kinds / sizeof job_kinds[0]; i++) {
        if (strcmp(what, job_kinds[i].name) == 0) {
            return begin_job(session, i, message, failure);
        }
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
    return session->control == client ? control(session, what, message, failure)
                                      : fail(failure, "another page has control: this one may watch, and stop");
}

static void on_message(void *context, unsigned long client, const char *text, size_t length) {
    session_t *const session = context;
    failure_t failure;
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
    static const char *const types[] = {NULL, "text/csv", "application/json", "application/octet-stream",
                                        "text/html; charset=utf-8"};
    const file_kind_t kind = folder_kind(session->options->folder, name);
    *type = types[kind];
    return kind != FILE_OTHER && folder_path(session->options->folder, name, found, &ignored) &&
           snprintf(path, size, "%s", found) < (int)size;
}

/* ---- Begin and end ---- */

session_t *session_open(const session_options_t *options, failure_t *failure) {
    session_t *session = allocate(1, sizeof *session);
    session->options = options;
    (void)pthread_mutex_init(&session->lock, NULL);
    (void)pthread_cond_init(&session->wished, NULL);
    json_t *const list = folder_list(options->folder, failure);
    if (list == NULL) {
        free(session);
        return NULL;
    }
    json_decref(list);
    session->handler = (web_handler_t){on_opened, on_closed, on_message, on_file, session};
    session->listener = (line_listener_t){on_line, on_snapshot, on_stopped, session};
    session->progress = (progress_listener_t){on_progress_begin, on_progress, on_progress_end, session};
    session->server = web_server_open(options->port, &session->handler, failure);
    if (session->server == NULL) {
        free(session);
        return NULL;
    }
    progress_listen(&session->progress);
    if (pthread_create(&session->reader, NULL, read_wishes, session) != 0) {
        (void)fail(failure, "cannot start a thread");
        web_server_close(session->server);
        free(session);
        return NULL;
    }
    session->keeper = line_keeper_start(&options->line, &session->listener, failure);
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
    if (session->job != NULL) {
        job_cancel(session->job);
        job_end(session->job);
    }
    pthread_mutex_lock(&session->lock);
    session->ending = true;
    pthread_cond_signal(&session->wished);
    pthread_mutex_unlock(&session->lock);
    (void)pthread_join(session->reader, NULL);
    progress_listen(NULL);
    /* Its last callbacks use the rest. */
    web_server_close(session->server);
    for (wish_t *wish; (wish = session->wishes) != NULL;) {
        session->wishes = wish->next;
        free(wish);
    }
    json_decref(session->line);
    json_decref(session->run.status);
    json_decref(session->job_activity.status);
    (void)pthread_cond_destroy(&session->wished);
    (void)pthread_mutex_destroy(&session->lock);
    free(session);
}

const char *session_address(const session_t *session) {
    return web_server_address(session->server);
}

bool session_run(session_t *session, const volatile sig_atomic_t *stop, failure_t *failure) {
    return web_server_run(session->server, stop, failure);
}
