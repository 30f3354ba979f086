/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command.h"
#include "diagnosis/diagnosis_json.h"
#include "diagnosis/diagnosis_report.h"
#include "diagnosis/diagnosis_text.h"
#include <malloc.h>
#include <stdlib.h>

/* OpenBLAS: its columns are short, and threads would spend their time waiting for each other. */
extern void openblas_set_num_threads(int threads);

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
    .arguments = "RECORDING... [--model MODEL.json] [options]",
    .summary = "Find out which physics a model of the recordings leaves out",
    .details = "Several recordings are one question with one answer. Without --model it begins with the hysteresis "
               "that fits best;\n"
               "with it, that chain is fitted again, as far as the recordings determine it. Each third of 36 blocks of "
               "time is held\n"
               "out: a finding is what these support. Errors are NRMSE: RMS error over the peak-to-peak displacement.\n"
               "detected: something of this kind; isolated: one of a few blocks that these recordings cannot tell "
               "apart; named.",
    .run = run};

typedef struct {
    const char *model, *json, *report, *output;
} outputs_t;

static bool run_diagnosis(const outputs_t *outputs, const recording_t *recordings, size_t count, diagnosis_t *diagnosis,
                          failure_t *failure) {
    model_t baseline;
    bool good;
    if (outputs->model == NULL) {
        return diagnose_recordings(recordings, count, diagnosis, failure);
    }
    if (!model_read(&baseline, outputs->model, failure)) {
        return false;
    }
    good = diagnose(&baseline, recordings, count, diagnosis, failure);
    model_free(&baseline);
    return good;
}

static bool write_outputs(const outputs_t *outputs, diagnosis_t *diagnosis, const recording_t *recordings, size_t count,
                          failure_t *failure) {
    account_t account;
    bool good;
    if (!account_for(diagnosis, recordings, count, &account, failure)) {
        return false;
    }
    good = (outputs->json == NULL ||
            diagnosis_write_json(diagnosis, &account, recordings, count, outputs->json, failure)) &&
           (outputs->output == NULL || model_write(&diagnosis->model, outputs->output, failure)) &&
           (outputs->report == NULL ||
            diagnosis_write_report(diagnosis, &account, recordings, count, outputs->report, failure));
    if (good) {
        diagnosis_print(diagnosis, &account, recordings, count);
    }
    account_free(&account);
    return good;
}

static int run(int argc, char **argv) {
    outputs_t outputs = {0};
    const option_t options[] = {
        {"--model", NULL, OPTION_TEXT, "MODEL.json", "the chain to begin with", &outputs.model},
        {"--output", "-o", OPTION_TEXT, "BETTER.json", "write the chain with what was found, fitted", &outputs.output},
        {"--json", NULL, OPTION_TEXT, "F.json", "write the diagnosis for programs", &outputs.json},
        {"--report", NULL, OPTION_TEXT, "F.html", "write it as a page with pictures", &outputs.report}};
    recording_t *recordings;
    size_t positionals, count = 0;
    failure_t failure;
    openblas_set_num_threads(1);
    keep_memory();
    diagnosis_t diagnosis;
    bool good = true;
    const int status = options_parse(&command_diagnose, options, sizeof options / sizeof options[0], argc, argv, 1,
                                     (size_t)argc, &positionals);
    if (status != OPTIONS_RUN) {
        return status;
    }
    recordings = allocate(positionals, sizeof *recordings);
    while (good && count < positionals) {
        good = recording_read(&recordings[count], argv[count + 1], &failure);
        count += good ? 1 : 0;
    }
    good = good && run_diagnosis(&outputs, recordings, count, &diagnosis, &failure);
    if (good) {
        good = write_outputs(&outputs, &diagnosis, recordings, count, &failure);
        diagnosis_free(&diagnosis);
    }
    for (size_t i = 0; i < count; i++) {
        recording_free(&recordings[i]);
    }
    free(recordings);
    return good ? STATUS_DONE : failure_print(&failure);
}
