/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/diagnosis_print.h"
#include "chain/catalogue.h"
#include "diagnosis/question/excerpt.h"
#include "report/advice.h"
#include "report/measured_columns_text.h"
#include "report/taken_out_text.h"
#include <math.h>

static const char *in_place(place_t place) {
    static const char *const phrases[PLACE_COUNT] = {"in the electronics", "in the hysteresis",
                                                     "among the slow effects", "in the mechanics", "in the sensor"};
    return phrases[place];
}

static void print_finding(FILE *file, const answer_t *answer, const account_t *account, size_t index,
                          const recording_t *recordings, size_t count) {
    const finding_t *finding = &answer->finding[index];
    const model_block_t *block = &answer->model.block[finding_index(answer, finding)];
    char text[DIAGNOSIS_LINE] = "", number[DIAGNOSIS_LINE];
    bool first = true;
    fprintf(file, "\n%zu. %s, %s (%s, confidence %.2f)\n", index + 1, finding->block->name,
            in_place(finding->block->place), certainty_name(finding->certainty), account->confidence[index]);
    finding_explanation(finding, text);
    text_wrapped(file, "   what", text);
    text[0] = '\0';
    for (size_t p = 0; p < block->block->parameters; p++) {
        if (number_is_told(block, p)) {
            parameter_text(block, p, number);
            text_append(text, "%s%s", first ? "" : ", ", number);
            first = false;
        }
    }
    text_wrapped(file, "   numbers", text);
    if (finding_times_text(answer, finding, text)) {
        text_wrapped(file, "   valid", text);
    }
    location_text(&account->where[index], recordings, count, text);
    text_wrapped(file, "   where", text);
    if (!finding->in_readings) {
        text[0] = '\0';
        text_append(text, "%.4f %% -> %.4f %% held out%s", finding->held_out_before_percent,
                    finding->held_out_after_percent, finding->heard ? ", beside the operator" : "");
        text_wrapped(file, "   error", text);
    }
    if (finding_columns_text(finding, &account->measured.finding[index], text)) {
        text_wrapped(file, "   beside", text);
    }
    if (finding->certainty != NAMED) {
        text[0] = '\0';
        text_append(text, "%s: hyst record --port DEV --probe %s", block_search(finding->block)->excitation,
                    finding_probe(finding));
        text_wrapped(file, "   record", text);
    }
}

/* "transport_delay -> prandtl_ishlinskii -> [creep]": findings in brackets. */
static void print_chain(FILE *file, const answer_t *answer) {
    char text[DIAGNOSIS_LINE] = "";
    size_t order[MODEL_MAX_BLOCKS];
    const size_t blocks = chain_order(&answer->model, order);
    for (size_t i = 0; i < blocks; i++) {
        const block_t *block = answer->model.block[order[i]].block;
        const bool found = finding_of(answer, block) != NULL;
        text_append(text, "%s%s%s%s", i > 0 ? " -> " : "", found ? "[" : "", block->name, found ? "]" : "");
    }
    text_wrapped(file, "chain", text);
}

/* "0.9000 % -> 0.5000 % -> 0.1000 %": the given chain, fitted again, with the findings. */
static void append_steps(char *text, const answer_t *answer, double given, double baseline, double found) {
    if (answer->question->model_given) {
        text_append(text, "%.4f %% -> ", given);
    }
    text_append(text, "%.4f %%", baseline);
    if (answer->findings > 0) {
        text_append(text, " -> %.4f %%", found);
    }
}

static void print_errors(FILE *file, const answer_t *answer) {
    char text[DIAGNOSIS_LINE] = "NRMSE ";
    append_steps(text, answer, answer->given_nrmse_percent, answer->baseline_nrmse_percent, answer->nrmse_percent);
    text_append(text, ", held out ");
    append_steps(text, answer, answer->given_held_out_percent, answer->baseline_held_out_percent,
                 answer->held_out_percent);
    if (isfinite(answer->noise_percent)) {
        text_append(text, "; noise %.4f %%", answer->noise_percent);
    }
    fputc('\n', file);
    text_wrapped(file, "error", text);
    text[0] = '\0';
    text_append(text,
                "as `hyst simulate` tells it of the whole recording, nothing taken out%s: %.4f %% (a straight line "
                "%.4f %%, 30 play operators %.4f %%)",
                answer->question->samples.count > 1 ? " but the zero of each file" : "", answer->delivered_percent,
                answer->line_percent, answer->plays_percent);
    text_wrapped(file, "", text);
    if (answer->question->model_given) {
        text[0] = '\0';
        text_append(text, "(the chain as it came in -> its numbers fitted again%s%s)",
                    diagnosis_other_shape(answer) != NULL ? ", with another shape of hysteresis" : "",
                    answer->findings > 0 ? " -> with what was found" : "");
        text_wrapped(file, "", text);
    }
}

static void print_refitted(FILE *file, const answer_t *answer) {
    char text[DIAGNOSIS_LINE];
    for (size_t i = 0; i < answer->refitted; i++) {
        for (size_t p = 0; p < answer->refitted_block[i]->parameters; p++) {
            if (refitted_text(answer, answer->refitted_block[i], p, text)) {
                text_wrapped(file, "refitted", text);
            }
        }
    }
}

static void print_unseen(FILE *file, const answer_t *answer) {
    enum { NAME_WIDTH = 26 };
    const unseen_t *unseen[DIAGNOSIS_MOST_UNSEEN];
    char text[DIAGNOSIS_LINE];
    size_t testable;
    const size_t count = unseen_in_order(answer, unseen, &testable);
    const bool limits = unseen_has_limits(answer);
    if (count > 0) {
        fprintf(file, "\nnot seen%s%s\n", answer->findings > 0 ? ", beside what was found" : "",
                limits ? "; sizes are those of the form of each block that shows best here"
                       : "; more than noise remains, and may hide effects of any size");
    }
    for (size_t i = 0; limits && i < testable; i++) {
        unseen_text(unseen[i], text);
        fprintf(file, "   %-*s would have been seen from %s\n", NAME_WIDTH, unseen[i]->block->name, text);
    }
    for (size_t i = testable; i < count; i++) {
        fprintf(file, "   %-*s not testable here: %s\n", NAME_WIDTH, unseen[i]->block->name, unseen[i]->why);
    }
    fprintf(file, "%s", count > 0 ? "\n" : "");
}

/* What to do now, before all that led to it. */
static void print_advice(FILE *file, const answer_t *answer) {
    char text[DIAGNOSIS_LINE];
    advice_on_verdict(answer, text);
    text_wrapped(file, "do now", text);
    fprintf(file, "next       hyst record --port DEV --probe %s\n", next_probe(answer));
}

static void print_taken_out(FILE *file, const account_t *account, const recording_t *recordings, size_t count) {
    char text[DIAGNOSIS_LINE];
    bool first = true;
    for (size_t i = 0; i < count; i++) {
        if (taken_out_text(account, recordings, i, text)) {
            text_wrapped(file, first ? "taken out" : "", text);
            first = false;
        }
    }
    for (size_t i = 0; i < count; i++) {
        if (lag_of_one_text(account, recordings, i, text)) {
            text_wrapped(file, "lag", text);
        }
    }
}

static void print_used(FILE *file, const recording_t *recordings, size_t count) {
    char text[DIAGNOSIS_LINE], used[EXCERPT_LINE];
    for (size_t i = 0; i < count; i++) {
        text[0] = '\0';
        if (excerpt_text(&recordings[i], used)) {
            text_append(text, "%s%s%s", count > 1 ? recordings[i].name : "", count > 1 ? ": " : "", used);
            text_wrapped(file, "used", text);
        }
    }
}

void diagnosis_print(FILE *file, const answer_t *answer, const account_t *account, const recording_t *recordings,
                     size_t count) {
    char text[DIAGNOSIS_LINE];
    print_used(file, recordings, count);
    verdict_sentence(answer, text);
    measured_columns_verdict(answer, &account->measured, text);
    text_wrapped(file, "verdict", text);
    print_advice(file, answer);
    print_chain(file, answer);
    for (size_t f = 0; f < answer->findings; f++) {
        print_finding(file, answer, account, f, recordings, count);
    }
    print_errors(file, answer);
    if (errors_caveat(answer) != NULL) {
        text_wrapped(file, "", errors_caveat(answer));
    }
    print_taken_out(file, account, recordings, count);
    print_refitted(file, answer);
    remainder_text(answer, text);
    text_wrapped(file, "remaining", text);
    if (account->remaining.somewhere) {
        location_text(&account->remaining, recordings, count, text);
        text_wrapped(file, "   where", text);
    }
    for (size_t c = 0; c < account->measured.count; c++) {
        measured_column_text(answer, &account->measured.column[c], text);
        text_wrapped(file, "measured", text);
    }
    fprintf(file, "tested     %zu signatures\n", answer->tested);
    print_unseen(file, answer);
}
