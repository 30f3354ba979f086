/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/opening.h"
#include "amplifier/model_guard.h"
#include "base/monotonic_clock.h"
#include "base/output_file.h"
#include "base/stop_signal.h"
#include "command_line/device_options.h"
#include "commands/command.h"
#include "compile/compile.h"
#include "interface/diagnosis_run.h"
#include "numerics/blas.h"
#include "report/event_page.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* Between two looks at the amplifier: a tenth of its communication timeout, and of the block it judges by. */
#define POLL_S 0.1
/* Less than this after the change is no recording to diagnose. */
#define LEAST_DIAGNOSED_S 0.2

enum { PATH_LENGTH = 4096, NAME_LENGTH = 64 };

typedef struct {
    device_options_t line;
    guard_settings_t guard;
    const char *model, *report;
    uint32_t model_id;
    unsigned long events;
    double for_s;
    bool json;
} settings_t;

/* One warning, from its record to its page. */
typedef struct {
    const settings_t *settings;
    event_t event;
    recording_t record;
    char folder[NAME_LENGTH];
} warning_t;

typedef struct {
    settings_t *settings;
    const volatile sig_atomic_t *stop;
    guard_t guard;
    double watched_s;                    /* in the amplifier's time, at the end */
    pid_t diagnosing;                    /* 0: none */
    unsigned long events, pages, failed; /* failed: warnings without their record or their page */
} watch_t;

/* FOLDER/NAME or FOLDER/NAME/FILE. */
static bool path_of(const warning_t *warning, const char *suffix, char path[PATH_LENGTH], failure_t *failure) {
    const int written = snprintf(path, PATH_LENGTH, "%s/%s%s", warning->settings->report, warning->folder, suffix);
    return (written > 0 && written < PATH_LENGTH) || fail(failure, "%s: name too long", warning->settings->report);
}

static bool make_folder(const char *path, failure_t *failure) {
    return mkdir(path, 0777) == 0 || errno == EEXIST || fail(failure, "%s: %s", path, strerror(errno));
}

/* Before there is a warning: whether a file can be made in it. */
static bool prepare_folder(const char *path, failure_t *failure) {
    char page[PATH_LENGTH];
    const char *const output = page;
    return ((size_t)snprintf(page, sizeof page, "%s/page.html", path) < sizeof page ||
            fail(failure, "%s: name too long", path)) &&
           make_folder(path, failure) && output_files_check(&output, 1, NULL, 0, failure);
}

/* The watch goes on: as long as it does, the amplifier hears from it. */
static void tell_failed(watch_t *watch, const failure_t *failure) {
    watch->failed++;
    (void)failure_print(failure);
}

/* Whether what was found can be compiled; the reason goes to the page. */
static bool can_compile(const model_t *model, failure_t *why) {
    const compile_options_t options = {0};
    hyst_parameters_t *image = allocate(1, sizeof *image);
    const bool done = compile_model(model, &options, image, NULL, why);
    free(image);
    return done;
}

static bool write_files(warning_t *warning, diagnosis_run_t *run, const recording_t *part, failure_t *failure) {
    answer_t *answer = &run->answer;
    char page[PATH_LENGTH], json[PATH_LENGTH], whole[PATH_LENGTH], better[PATH_LENGTH];
    failure_t why = {{0}};
    if (!path_of(warning, ".html", page, failure) || !path_of(warning, ".json", json, failure) ||
        !path_of(warning, "/diagnosis.html", whole, failure) || !path_of(warning, "/better.json", better, failure)) {
        return false;
    }
    event_t *event = &warning->event;
    event->better = answer->verdict != UNKNOWN_PHYSICS && can_compile(&answer->model, &why);
    event->not_better = event->better                        ? NULL
                        : answer->verdict == UNKNOWN_PHYSICS ? "What changed is in no catalogue."
                                                             : why.text;
    answer->written_to = better;
    return model_write(&answer->model, better, failure) && diagnosis_run_report(run, part, 1, whole, failure) &&
           event_write_json(event, answer, &run->account, part, 1, json, failure) &&
           event_write_page(event, answer, &run->account, page, failure); /* last: it says that all is there */
}

static bool diagnose_warning(warning_t *warning, failure_t *failure) {
    model_t model;
    if (!model_read(&model, warning->settings->model, failure)) {
        return false;
    }
    const recording_t *record = &warning->record;
    const double most_s = (double)record->samples / record->sample_rate_hz - LEAST_DIAGNOSED_S;
    const double changed_s = warning->event.since_s + EVENT_SINCE_S; /* by then it has surely changed */
    const double from_s = isnan(changed_s) ? 0.0 : fmax(0.0, fmin(changed_s, most_s));
    recording_t part;
    diagnosis_run_t run;
    const size_t from = (size_t)(from_s * record->sample_rate_hz);
    recording_copy(&part, record, from, record->samples - from); /* from the change on */
    bool good = diagnosis_run(&model, &part, 1, 0, &run, failure);
    if (good) {
        good = write_files(warning, &run, &part, failure);
        diagnosis_run_free(&run);
    }
    recording_free(&part);
    model_free(&model);
    return good;
}

static double rms_from(const recording_t *record, double from_s) {
    double squares = 0.0;
    const size_t from = isnan(from_s) ? 0 : (size_t)(from_s * record->sample_rate_hz);
    for (size_t i = from; i < record->samples; i++) {
        const double error = record->column[COLUMN_DISPLACEMENT][i] - record->column[COLUMN_REFERENCE][i];
        squares += error * error;
    }
    return sqrt(squares / (double)(record->samples - from));
}

/* The record, and what is known of it. */
static bool fetch_record(watch_t *watch, warning_t *warning, failure_t *failure) {
    const guard_t *guard = &watch->guard;
    size_t warned = 0;
    if (!guard_fetch(&watch->guard, &warning->record, &warned, failure)) {
        return false;
    }
    const recording_t *r = &warning->record;
    const double after_s = (double)(r->samples - warned) / r->sample_rate_hz;
    event_t *event = &warning->event;
    *event =
        (event_t){.warned_at = time(NULL) - (time_t)lround(after_s),
                  .sample_time_s = (double)guard->now[INDEX_sequence] / device_sample_rate_hz(guard->device) - after_s,
                  .warned_s = (double)warned / r->sample_rate_hz,
                  .limit_um = guard->limit_um,
                  .usual_um = guard->usual.rms_um,
                  .usual_supply_v = guard->usual_supply_v,
                  .supply_v = guard_supply_v(guard),
                  .record = r,
                  .folder = warning->folder};
    event->since_s = event_since_s(r, event->warned_s, guard->settings.time_s, event->usual_um, event->limit_um);
    event->rms_um = rms_from(r, event->since_s);
    event_time_text(event->warned_at, warning->folder);
    for (char *c = warning->folder; *c != '\0'; c++) {
        *c = *c == ':' ? '-' : *c; /* names that every file system takes */
    }
    return true;
}

/* As it came, in a folder beside the page. */
static bool keep_record(const warning_t *warning, failure_t *failure) {
    char path[PATH_LENGTH];
    return path_of(warning, "", path, failure) && make_folder(path, failure) &&
           path_of(warning, "/recording.csv", path, failure) && recording_write(&warning->record, path, failure);
}

/* Looks whether the diagnosis has come to its end. */
static void collect(watch_t *watch, bool wait) {
    int status = 0;
    failure_t failure;
    if (watch->diagnosing == 0) {
        return;
    }
    const pid_t ended = waitpid(watch->diagnosing, &status, wait ? 0 : WNOHANG);
    if (ended == 0 || (ended < 0 && errno == EINTR)) {
        return;
    }
    watch->diagnosing = 0;
    watch->pages++;
    if (ended < 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        (void)fail(&failure, "a diagnosis failed; its record is in %s", watch->settings->report);
        tell_failed(watch, &failure);
    }
}

/* Between two looks. */
static bool rest(void *context, failure_t *failure) {
    watch_t *watch = context;
    sleep_until(monotonic_s() + POLL_S);
    if (*watch->stop != 0) {
        return fail(failure, "interrupted (%s)", stop_signal_name(*watch->stop));
    }
    collect(watch, false);
    return true;
}

/* The amplifier must hear from this process meanwhile, so another one diagnoses. */
static bool start_diagnosis(watch_t *watch, warning_t *warning, failure_t *failure) {
    while (watch->diagnosing != 0) {
        if (!rest(watch, failure) || guard_look(&watch->guard, failure) == GUARD_FAILED) {
            return false;
        }
    }
    (void)fflush(NULL);
    watch->diagnosing = fork();
    if (watch->diagnosing == 0) {
        failure_t own;
        device_leave_to_parent(watch->guard.device); /* were the parent killed, the line would stay locked */
        const bool good = diagnose_warning(warning, &own);
        if (!good) {
            (void)failure_print(&own);
        }
        (void)fflush(NULL);
        _exit(good ? STATUS_DONE : STATUS_FAILED);
    }
    return watch->diagnosing > 0 || fail(failure, "no process for the diagnosis: %s", strerror(errno));
}

static void print_limit(const watch_t *watch) {
    const guard_t *g = &watch->guard;
    if (!text_wanted(watch->settings->json)) {
        return;
    }
    printf("watching: the error is %.4g um (root mean square, of which slow %.4g, fast %.4g); limit %.4g um for %g s\n",
           g->usual.rms_um, g->usual.slow_um, g->usual.fast_um, g->limit_um, g->settings.time_s);
    (void)fflush(stdout);
}

static void print_warning(const warning_t *warning) {
    const event_t *event = &warning->event;
    const bool dated = !isnan(event->since_s);
    if (text_wanted(warning->settings->json)) {
        printf("warning: %.4g um since %s%.2f s before it; record and page: %s/%s\n", event->rms_um,
               dated ? "" : "more than ", dated ? event->warned_s - event->since_s : event->warned_s,
               warning->settings->report, warning->folder);
        (void)fflush(stdout);
    }
}

static bool take_warning(watch_t *watch, failure_t *failure) {
    warning_t warning = {.settings = watch->settings};
    failure_t of_file;
    bool good = true;
    if (!fetch_record(watch, &warning, failure)) {
        return false;
    }
    watch->events++;
    print_warning(&warning);
    if (keep_record(&warning, &of_file)) {
        good = start_diagnosis(watch, &warning, failure);
    } else {
        tell_failed(watch, &of_file);
    }
    recording_free(&warning.record);
    good = good && guard_again(&watch->guard, rest, watch, failure);
    if (good) {
        print_limit(watch);
    }
    return good;
}

static bool goes_on(const watch_t *watch) {
    const settings_t *s = watch->settings;
    return (s->events == 0 || watch->events < s->events) &&
           (s->for_s <= 0.0 || guard_clock_s(&watch->guard) < s->for_s);
}

static bool watch_on(watch_t *watch, device_t *device, const hyst_parameters_t *image, failure_t *failure) {
    if (!guard_begin(&watch->guard, device, image, &watch->settings->guard, rest, watch, failure)) {
        return false;
    }
    print_limit(watch);
    while (goes_on(watch)) {
        const guard_answer_t answer = guard_look(&watch->guard, failure);
        if (answer == GUARD_FAILED ||
            (answer == GUARD_WARNED ? !take_warning(watch, failure) : !rest(watch, failure))) {
            return false;
        }
    }
    while (watch->diagnosing != 0) { /* the amplifier plays on meanwhile */
        if (!rest(watch, failure) || guard_look(&watch->guard, failure) == GUARD_FAILED) {
            return false;
        }
    }
    return guard_end(&watch->guard, failure);
}

static bool tell_end(const watch_t *watch, failure_t *failure) {
    const settings_t *s = watch->settings;
    const double seconds = watch->watched_s;
    if (s->json && !json_print(json_pack("{s:s, s:I, s:f, s:s}", "format", "hyst-watched-1", "warnings",
                                         (json_int_t)watch->events, "seconds", seconds, "folder", s->report),
                               JSON_INDENT(2), failure)) {
        return false;
    }
    if (text_wanted(s->json)) {
        printf("%lu warnings in %.1f s of the amplifier's time\n", watch->events, seconds);
    }
    return true;
}

/* Signals end it as they should. */
static int work(device_t *device, void *context) {
    watch_t *watch = context;
    hyst_parameters_t image;
    failure_t failure, ignored;
    watch->stop = stop_on_signal();
    (void)blas_threads(1);
    if (!amplifier_image_read(device, &image, &failure) ||
        !amplifier_image_is_of(&image, watch->settings->model_id, watch->settings->model, &failure)) {
        return failure_print(&failure);
    }
    const bool good = watch_on(watch, device, &image, &failure);
    watch->watched_s = guard_clock_s(&watch->guard);
    if (!good && *watch->stop == 0) {
        return failure_print(&failure);
    }
    if (!good) {
        (void)guard_end(&watch->guard, &ignored);
    }
    return STATUS_DONE;
}

/* A page that has begun is written, and the line is free meanwhile: nothing is sent on it any more. A second signal
 * leaves the page to the process that diagnoses. 1: a warning has no record, or no page. */
static int finish(void *context, int status) {
    watch_t *watch = context;
    failure_t failure;
    collect(watch, false);
    if (watch->diagnosing != 0) {
        (void)fputs("note: the line is free; waiting for the page of the last warning\n", stderr);
        collect(watch, true);
    }
    if (status != STATUS_DONE) {
        return status;
    }
    if (!tell_end(watch, &failure)) {
        return failure_print(&failure);
    }
    return watch->failed > 0 || watch->diagnosing != 0 ? STATUS_FAILED : STATUS_DONE;
}

static int check(void *context) {
    settings_t *s = ((watch_t *)context)->settings;
    failure_t failure;
    model_t model;
    if (s->model == NULL || s->report == NULL) {
        return usage_error(&command_watch, "--model MODEL.json and --report FOLDER are both needed");
    }
    if (!guard_settings_check(&s->guard, &failure)) {
        return usage_error(&command_watch, "%s", failure.text);
    }
    if (s->for_s < 0.0) {
        return usage_error(&command_watch, "--for %g: must not be negative", s->for_s);
    }
    if (!model_read(&model, s->model, &failure)) {
        return failure_print(&failure);
    }
    s->model_id = compile_model_id(&model);
    model_free(&model);
    return prepare_folder(s->report, &failure) ? OPTIONS_RUN : failure_print(&failure);
}

static int run(int argc, char **argv) {
    settings_t s = {.line = DEVICE_OPTIONS_DEFAULT, .guard = GUARD_SETTINGS_DEFAULT};
    watch_t watch = {.settings = &s};
    const option_t options[] = {
        DEVICE_OPTIONS(s.line),
        {"--model", NULL, OPTION_INPUT, "MODEL.json", "the chain whose image is in force; another one is refused",
         &s.model},
        {"--report", NULL, OPTION_TEXT, "FOLDER", "where the pages go", &s.report},
        {"--limit", NULL, OPTION_NUMBER, "UM", "on the error's root mean square (measured at the start)",
         &s.guard.limit_um},
        {"--times", NULL, OPTION_NUMBER, "N", "without --limit: so many times what is usual (2)", &s.guard.times},
        {"--time", NULL, OPTION_NUMBER, "S", "how long above it (0.5 s)", &s.guard.time_s},
        {"--before", NULL, OPTION_NUMBER, "S", "recorded before a warning (1.2 s)", &s.guard.before_s},
        {"--after", NULL, OPTION_NUMBER, "S", "recorded after it (1.2 s)", &s.guard.after_s},
        {"--events", "-n", OPTION_COUNT, "N", "end after so many warnings; 0, the default: until stopped", &s.events},
        {"--for", NULL, OPTION_NUMBER, "S", "end after so long, in the amplifier's time (until stopped)", &s.for_s},
        JSON_OPTION(&s.json),
    };
    const device_work_t job = {.settings = &watch, .line = &s.line, .check = check, .work = work, .after = finish};
    return device_command_run(&command_watch, options, sizeof options / sizeof options[0], argc, argv, &job);
}

const command_t command_watch = {
    .name = "watch",
    .order = 115,
    .arguments = "--port DEV --model MODEL.json --report FOLDER",
    .summary = "Wait until the amplifier's model is no longer true, and say why",
    .details =
        "Moves nothing: the amplifier does its work in mode compensate, by `hyst play` or another master. Its own "
        "watch "
        "compares\n"
        "the position with the reference. First it is measured what error is usual. More than --times as much for "
        "--time is a\n"
        "warning, which stops nothing and freezes the recorder with the history before it. The record is fetched and "
        "diagnosed,\n"
        "and FOLDER gets a dated page: what changed, since when, how sure, what to push. What is there then counts as "
        "usual.\n"
        "As long as it has the line, the amplifier's communication timeout does not pass. Ctrl-C ends it: the line is "
        "free at\n"
        "once, and a page that has begun is still written.",
    .run = run,
    .files = FILE_MODEL "FOLDER/DATE.html, .json: a page and the same for programs (hyst-watch-1), one a warning.\n"
                        "FOLDER/DATE/: recording.csv, diagnosis.html, better.json of that warning.\n",
    .examples = "# An amplifier at work, day and night\n"
                "hyst watch --port /dev/ttyUSB0 --model model.json --report warnings\n"};
