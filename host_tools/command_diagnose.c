/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "command.h"
#include "diagnosis/diagnose.h"
#include <stdio.h>
#include <stdlib.h>

static int run(int argc, char **argv);

const command_t command_diagnose = {.name = "diagnose",
                                    .arguments = "RECORDING... [options]",
                                    .summary = "Find out which physics a model of the recordings leaves out",
                                    .details = "",
                                    .run = run};

static int run(int argc, char **argv) {
    const char *path = NULL, *output = NULL;
    const option_t options[] = {{"--model", NULL, OPTION_TEXT, "MODEL", "the chain to start from", &path},
                                {"--output", "-o", OPTION_TEXT, "MODEL.json", "write the augmented chain", &output}};
    recording_t *recordings;
    size_t positionals, count = 0;
    failure_t failure;
    diagnosis_t d;
    model_t baseline;
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
    if (good && path != NULL) {
        good = model_read(&baseline, path, &failure);
        if (good) {
            good = diagnose(&baseline, recordings, count, &d, &failure);
            model_free(&baseline);
        }
    } else if (good) {
        good = diagnose_recordings(recordings, count, &d, &failure);
    }
    if (good) {
        printf("baseline %.4f %% held out %.4f %%; after %.4f %% held out %.4f %%; noise %.4f %%; tested %zu\n",
               d.baseline_nrmse_percent, d.baseline_held_out_percent, d.nrmse_percent, d.held_out_percent,
               d.noise_percent, d.tested);
        for (size_t i = 0; i < d.findings; i++) {
            const finding_t *f = &d.finding[i];
            printf("%s %s t %.1f tb %.1f margin %.1f held out %.4f -> %.4f rivals", f->block->name,
                   f->certainty == NAMED      ? "NAMED"
                   : f->certainty == ISOLATED ? "isolated"
                                              : "detected",
                   f->t, f->t_blocks, f->margin, f->held_out_before_percent, f->held_out_after_percent);
            for (size_t r = 0; r < f->rivals; r++)
                printf(" %s", f->rival[r]->name);
            printf("\n");
        }
        diagnosis_free(&d);
    }
    return good ? STATUS_DONE : failure_print(&failure);
}
