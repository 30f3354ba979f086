/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/monotonic_clock.h"
#include "base/provenance.h"
#include "command_line/recording_input.h"
#include "commands/command.h"
#include "commands/diagnose_script.h"
#include "interface/exchanged.h"
#include "interface/sure.h"
#include "numerics/blas.h"
#include <malloc.h>
#include <math.h>
#include <stdlib.h>

/* Columns come and go all the time: memory that went back to the system each time would be zeroed by it each time. */
static void keep_memory(void) {
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
}

static int run(int argc, char **argv);

const command_t command_diagnose = {
    .name = "diagnose",
    .order = 30,
    .arguments = "RECORDING... [--model MODEL.json] [options]",
    .summary = "Find out which physics a model of the recordings leaves out",
    .details = "Several recordings are one question with one answer. Without --model it begins with the hysteresis "
               "that fits best;\n"
               "with it, that chain is fitted again, as far as the recordings determine it. Each third of 36 blocks of "
               "time is held\n"
               "out: a finding is what these support. Errors are NRMSE: RMS error over the peak-to-peak displacement.\n"
               "detected: something of this kind; isolated: one of a few blocks that these recordings cannot tell "
               "apart; named.",
    .run = run,
    .files = FILE_RECORDING FILE_MODEL "F.json: the findings for programs, format hyst-diagnosis-1.\n"
                                       "F.html: one page with pictures; it needs nothing beside it.\n"
                                       "F.py: a script for the Python package hyst (docs/PYTHON.md).\n",
    .examples = "# What does the model leave out? Write the extended model, and a page\n"
                "hyst diagnose probe.csv --model model.json -o better.json --report diagnosis.html\n"
                "# Start without a model, from two recordings\n"
                "hyst diagnose first.csv second.csv\n"
                "# A first answer to a long recording, in a fraction of the time\n"
                "hyst diagnose long.csv --samples 25000\n"
                "# How sure is the answer? Ask 10 recordings of each kind, simulated like this one\n"
                "hyst diagnose probe.csv --sure=10\n"
                "# Go on from there in Python\n"
                "hyst diagnose probe.csv --model model.json --emit-python diagnose.py\n"};

typedef struct {
    const char *model, *report, *output, *script, *title;
    bool json, columns_are_right;
    unsigned long samples, sure, seed; /* samples: 0: as many as usual; sure: 0: not asked */
} outputs_t;

/* "about 40 s", "about 5 min". */
static void tell_duration(const sure_work_t *work) {
    const bool minutes = work->seconds >= 120.0;
    fprintf(stderr, "hyst diagnose: %zu recordings of each of %zu kinds are simulated and asked: about %.0f %s\n",
            work->sure.each, work->worlds, ceil(minutes ? work->seconds / 60.0 : work->seconds), minutes ? "min" : "s");
}

/* The diagnosis; and, where it is wanted, how sure it is. */
static bool diagnose_chain(const outputs_t *outputs, const model_t *given, recording_t *recordings, size_t count,
                           diagnosis_run_t *run, failure_t *failure) {
    const double begun_s = monotonic_s();
    if (!diagnosis_run(given, recordings, count, outputs->samples, run, failure)) {
        return false;
    }
    if (outputs->sure == 0) {
        return true;
    }
    sure_work_t work;
    sure_prepare(run, outputs->sure == OPTION_NO_COUNT ? 0 : outputs->sure, outputs->seed, monotonic_s() - begun_s,
                 &work);
    tell_duration(&work);
    if (!sure_ask(&work, given, recordings, count, run, failure)) {
        diagnosis_run_free(run);
        return false;
    }
    return true;
}

static bool diagnose_files(const outputs_t *outputs, recording_t *recordings, size_t count, diagnosis_run_t *answer,
                           failure_t *failure) {
    model_t given;
    if (outputs->model == NULL) {
        return diagnose_chain(outputs, NULL, recordings, count, answer, failure);
    }
    if (!model_read(&given, outputs->model, failure)) {
        return false;
    }
    const bool good = diagnose_chain(outputs, &given, recordings, count, answer, failure);
    model_free(&given);
    return good;
}

/* To the file or the stream that --json has named. */
static bool write_json(const outputs_t *outputs, const diagnosis_run_t *run, const recording_t *recordings,
                       size_t count, failure_t *failure) {
    return !outputs->json ||
           json_print(diagnosis_run_to_json(run, recordings, count), JSON_INDENT(1) | JSON_REAL_PRECISION(17), failure);
}

static bool write_outputs(const outputs_t *outputs, diagnosis_run_t *run, const recording_t *recordings, size_t count,
                          failure_t *failure) {
    answer_t *answer = &run->answer;
    answer->written_to = outputs->output;
    const bool good =
        write_json(outputs, run, recordings, count, failure) &&
        (outputs->output == NULL || model_write(&answer->model, outputs->output, failure)) &&
        (outputs->report == NULL || diagnosis_run_report(run, recordings, count, outputs->report, failure));
    if (good && text_wanted(outputs->json)) {
        diagnosis_run_print(stdout, run, recordings, count);
    }
    return good;
}

static int run(int argc, char **argv) {
    outputs_t outputs = {.seed = 1};
    span_t span = SPAN_WHOLE;
    const option_t options[] = {
        {"--model", NULL, OPTION_INPUT, "MODEL.json", "the chain to begin with", &outputs.model},
        {"--output", "-o", OPTION_OUTPUT, "BETTER.json", "write the chain with what was found, fitted",
         &outputs.output},
        SPAN_OPTIONS(span),
        {"--samples", NULL, OPTION_COUNT, "N",
         "use at most so many, one window of each recording: sooner, but less is seen; 0, the default: 250000",
         &outputs.samples},
        {"--columns-are-right", NULL, OPTION_FLAG, NULL,
         "go on where drive and displacement look exchanged, and a fit says so too", &outputs.columns_are_right},
        JSON_OPTION_KIND(OPTION_JSON_OR_WORD, &outputs.json),
        {"--sure", NULL, OPTION_COUNT_IF, NULL,
         "simulate N recordings like these from the answer and from what may be meant instead, and ask again",
         &outputs.sure},
        {"--seed", NULL, OPTION_COUNT, "N", "of the noise of --sure; 1", &outputs.seed},
        {"--report", NULL, OPTION_OUTPUT, "F.html", "write it as a page with pictures", &outputs.report},
        {"--title", NULL, OPTION_TEXT, "TEXT", "heading of that page, for a lab book", &outputs.title},
        {"--emit-python", NULL, OPTION_OUTPUT, "F.py", "write the Python script that repeats this", &outputs.script}};
    size_t count;
    failure_t failure;
    (void)blas_threads(1);
    keep_memory();
    diagnosis_run_t answer;
    const int status = options_parse(&command_diagnose, options, sizeof options / sizeof options[0], argc, argv, 1,
                                     (size_t)argc, &count);
    if (status != OPTIONS_RUN) {
        return status;
    }
    if (outputs.title != NULL && outputs.report == NULL) {
        return usage_error(&command_diagnose, "--title is of the page that --report writes");
    }
    provenance_set_title(outputs.title);
    recording_t *recordings = read_spans_aloud(argv + 1, count, &span, &failure);
    bool good = recordings != NULL;
    good = good && (outputs.columns_are_right || exchanged_refuse(recordings, count, NULL, &failure));
    good = good && diagnose_files(&outputs, recordings, count, &answer, &failure);
    diagnose_script_t script = {.recordings = argv + 1,
                                .count = count,
                                .model = outputs.model,
                                .from_s = span.from_s,
                                .to_s = span.to_s,
                                .json = json_file(),
                                .report = outputs.report,
                                .title = outputs.title,
                                .samples = outputs.samples,
                                .columns_are_right = outputs.columns_are_right,
                                .output = outputs.output,
                                .seed = outputs.seed};
    if (good) {
        script.sure = answer.sure_asked ? answer.sure.each : 0;
        good = write_outputs(&outputs, &answer, recordings, count, &failure);
        diagnosis_run_free(&answer);
        good = good && (outputs.script == NULL || diagnose_script_write(&script, outputs.script, &failure));
    }
    recordings_free(recordings, count);
    return good ? STATUS_DONE : failure_print(&failure);
}
