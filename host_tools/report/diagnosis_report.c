/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/diagnosis_report.h"
#include "base/shown_name.h"
#include "chain/catalogue.h"
#include "diagnosis/question/excerpt.h"
#include "page/html_page.h"
#include "page/svg_plot.h"
#include "report/advice.h"
#include "report/bode.h"
#include "report/diagnosis_pictures.h"
#include "report/diagnosis_text.h"
#include "report/measured_columns_text.h"
#include "report/noise_budget.h"
#include "report/prose.h"
#include "report/taken_out_text.h"
#include <math.h>
#include <stdlib.h>

/* Percent: half of the last digit of a printed error. */
static const double shown_percent = 5e-5;

static const char style[] =
    "<style>\n.chain{display:flex;flex-wrap:wrap;gap:.6rem 0;list-style:none;margin:.8rem 0;padding:0}"
    ".chain li{display:flex;align-items:center}.chain li+li::before{content:\"→\";color:var(--soft);padding:0 .45rem}"
    ".box{display:block;border:1px solid var(--soft);border-radius:.3rem;padding:.3rem .7rem;background:var(--shade)}"
    ".box small{display:block;color:var(--soft)}.end{color:var(--soft)}"
    ".found{border:.16rem solid var(--after);background:var(--paper)}.found b{color:var(--after)}"
    "dl{display:grid;grid-template-columns:max-content 1fr;gap:.2rem 1rem;margin:.5rem 0;max-width:60rem}"
    "dt{color:var(--soft)}dd{margin:0}td.text,th.text{text-align:left;min-width:min(20rem,40vw)}"
    ".words td,.words th{text-align:left;vertical-align:top}.words td:nth-child(2){min-width:14rem}"
    "code{display:inline-block}"
    ".long{break-inside:auto}.long td{vertical-align:top}tr{break-inside:avoid}"
    ".bar{display:inline-block;height:.7rem;background:var(--before);vertical-align:baseline;min-width:1px}"
    ".bar.last{background:var(--after)}.bar.noise{background:var(--soft)}td.bars{width:50%;text-align:left}"
    ".pictures{grid-template-columns:repeat(auto-fill,minmax(min(26rem,100%),1fr))}"
    "@media(max-width:40rem){dl{grid-template-columns:1fr;gap:0}dd{margin-bottom:.4rem}.chain{flex-direction:column}"
    ".words thead{display:none}.words td{display:block;border:0;padding:0}.words td:nth-child(2){min-width:0}"
    ".words td:first-child{font-weight:600;padding-top:.5rem}td.bars{width:20%}"
    ".chain li{flex-direction:column;align-items:flex-start}.chain li+li::before{content:\"↓\";padding:0 1rem}}"
    "@media print{h2{margin-top:1.3rem}.verdict{font-size:1rem}.pictures "
    ".plot{width:90%}th,td{padding-top:.12rem;padding-bottom:.12rem}"
    ".pictures{grid-template-columns:1fr 1fr;gap:.4rem 1.5rem}"
    ".bar,.box{print-color-adjust:exact;-webkit-print-color-adjust:exact}}\n</style>\n";

typedef struct {
    FILE *file;
    const answer_t *answer;
    const account_t *account;
    const recording_t *recordings;
    size_t count;
    const look_t *looks; /* NULL: none */
} page_t;

static void write_recordings(const page_t *page) {
    char text[EXCERPT_LINE];
    fprintf(page->file, "<p class=\"note\">");
    for (size_t i = 0; i < page->count; i++) {
        const recording_t *r = &page->recordings[i];
        write_escaped(page->file, without_folder(r->name));
        fprintf(page->file, ": %.4g s at %.6g Hz", (double)r->samples / r->sample_rate_hz, r->sample_rate_hz);
        for (size_t k = 0; k < r->keys; k++) {
            fprintf(page->file, ", ");
            write_escaped(page->file, r->key[k].key);
            fprintf(page->file, " ");
            write_escaped(page->file, r->key[k].value);
        }
        fprintf(page->file, "%s", i + 1 < page->count ? "; " : ".");
        if (excerpt_text(r, text)) {
            fprintf(page->file, " Used: %s", text);
        }
    }
    fprintf(page->file, "</p>\n");
}

static void write_bar(FILE *file, const char *what, double percent, double most, const char *class_name) {
    fprintf(file,
            "<tr><td>%s</td><td>%.4f</td><td class=\"bars\"><span class=\"bar%s\" "
            "style=\"width:%.1f%%\"></span></td></tr>\n",
            what, percent, class_name, 100.0 * percent / most);
}

/* Whether the chain's error differs from that of the last step, since all findings were fitted once more together. */
static bool fitted_again(const answer_t *answer) {
    return answer->findings > 0 && fabs(answer->held_out_percent -
                                        answer->finding[answer->findings - 1].held_out_after_percent) > shown_percent;
}

/* What stands between these errors and those of a simulation, of each recording. */
static void write_taken_out(const page_t *page) {
    char text[DIAGNOSIS_LINE];
    fprintf(page->file,
            "<p class=\"note\">As <code>hyst simulate</code> tells it of the whole recording, nothing taken out%s: "
            "%.3g&nbsp;%%; a straight line %.3g&nbsp;%%, 30 play operators %.3g&nbsp;%%.</p>\n",
            page->count > 1 ? " but the zero of each file" : "", page->answer->delivered_percent,
            page->answer->line_percent, page->answer->plays_percent);
    for (size_t i = 0; i < page->count; i++) {
        if (taken_out_text(page->account, page->recordings, i, text)) {
            fprintf(page->file, "<p class=\"note\">Taken out: ");
            write_prose(page->file, text);
            fprintf(page->file, ".</p>\n");
        }
        if (lag_of_one_text(page->account, page->recordings, i, text)) {
            fprintf(page->file, "<p class=\"note\">");
            write_prose(page->file, text);
            fprintf(page->file, ".</p>\n");
        }
    }
}

/* The held-out error after every step. */
static void write_errors(const page_t *page) {
    const answer_t *answer = page->answer;
    const bool was_given = answer->question->model_given;
    const block_t *another = diagnosis_other_shape(answer);
    const bool noise_known = isfinite(answer->noise_percent);
    double most = fmax(fmax(answer->baseline_held_out_percent, answer->held_out_percent),
                       noise_known ? answer->noise_percent : 0.0);
    most = was_given ? fmax(most, answer->given_held_out_percent) : most;
    most = another != NULL ? fmax(most, answer->own_shape_held_out_percent) : most;
    for (size_t f = 0; f < answer->findings; f++) {
        most = fmax(most, answer->finding[f].heard ? 0.0 : answer->finding[f].held_out_after_percent);
    }
    fprintf(page->file,
            "<div class=\"wide\"><table>\n<thead><tr><th>Model</th><th>Held-out error, %%</th><th></th></tr>"
            "</thead>\n<tbody>\n");
    if (was_given) {
        write_bar(page->file, "as it came in", answer->given_held_out_percent, most, "");
    }
    if (another != NULL) {
        write_bar(page->file, "numbers fitted again", answer->own_shape_held_out_percent, most, "");
    }
    write_bar(page->file,
              another != NULL        ? "another hysteresis"
              : was_given            ? "numbers fitted again"
              : answer->findings > 0 ? "before"
                                     : "the model",
              answer->baseline_held_out_percent, most, answer->findings > 0 ? "" : " last");
    for (size_t f = 0; f < answer->findings; f++) {
        char what[100];
        if (answer->finding[f].heard) { /* its error is the operator's, no step of the model's */
            continue;
        }
        snprintf(what, sizeof what, "+&nbsp;%s", answer->finding[f].block->name);
        write_bar(page->file, what, answer->finding[f].held_out_after_percent, most,
                  f + 1 < answer->findings || fitted_again(answer) ? "" : " last");
    }
    if (fitted_again(answer)) {
        write_bar(page->file, answer_has_heard(answer) ? "with all that was found" : "all, fitted together",
                  answer->held_out_percent, most, " last");
    }
    if (noise_known) {
        write_bar(page->file, "noise", answer->noise_percent, most, " noise");
    }
    fprintf(page->file,
            "</tbody></table></div>\n<p class=\"note\">RMS error over the peak-to-peak displacement, worst recording, "
            "on the blocks of time that were held out: each third one of 36. On the others: ");
    if (was_given) {
        fprintf(page->file, "%.4f&nbsp;%% as it came in, ", answer->given_nrmse_percent);
    }
    if (answer->findings > 0) {
        fprintf(page->file, "%.4f&nbsp;%% before, ", answer->baseline_nrmse_percent);
    }
    fprintf(page->file, "%.4f&nbsp;%%%s. %s%sNoise: %s.</p>\n", answer->nrmse_percent,
            answer->findings > 0 ? " after" : "", errors_caveat(answer) != NULL ? errors_caveat(answer) : "",
            errors_caveat(answer) != NULL ? " " : "",
            answer->question->noise.at_rest          ? "what the reading does while the drive rests"
            : answer->question->noise.between_passes ? "what passes of the same path differ by"
                                                     : "what a rich model leaves, as the drive never rests for long");
    write_taken_out(page);
}

/* Parameters of the given chain that changed. */
static void write_refitted(const page_t *page) {
    const answer_t *answer = page->answer;
    char text[DIAGNOSIS_LINE];
    for (size_t i = 0; i < answer->refitted; i++) {
        for (size_t p = 0; p < answer->refitted_block[i]->parameters; p++) {
            if (refitted_text(answer, answer->refitted_block[i], p, text)) {
                fputs("<p class=\"note\">Fitted again: ", page->file);
                write_prose(page->file, text);
                fputs(".</p>\n", page->file);
            }
        }
    }
}

static void write_chain(const page_t *page) {
    const model_t *model = &page->answer->model;
    size_t order[MODEL_MAX_BLOCKS];
    const size_t blocks = chain_order(model, order);
    fprintf(page->file, "<h2>The chain</h2>\n<ol class=\"chain\">\n<li><span class=\"end\">drive</span></li>\n");
    for (size_t i = 0; i < blocks; i++) {
        const block_t *block = model->block[order[i]].block;
        const finding_t *finding = finding_of(page->answer, block);
        const bool another = diagnosis_other_shape(page->answer) == block;
        fprintf(page->file, "<li><span class=\"box%s\"><b>%s</b><small>%s%s%s</small></span></li>\n",
                finding != NULL || another ? " found" : "", block->name, place_name(block->place),
                finding != NULL || another ? ", " : "",
                another           ? "in place of the given one"
                : finding != NULL ? finding_standing(page->answer, finding)
                                  : "");
    }
    fprintf(page->file, "<li><span class=\"end\">reading</span></li>\n</ol>\n");
    write_refitted(page);
}

static void write_row(FILE *file, const char *term, const char *text) {
    fprintf(file, "<dt>%s</dt><dd>", term);
    write_prose(file, text);
    fprintf(file, "</dd>\n");
}

static void write_numbers(const page_t *page, const finding_t *finding) {
    const model_block_t *block = &page->answer->model.block[finding_index(page->answer, finding)];
    fprintf(page->file, "<dt>Numbers</dt><dd>");
    for (size_t p = 0, written = 0; p < block->block->parameters; p++) {
        if (number_is_told(block, p)) {
            char text[DIAGNOSIS_LINE];
            parameter_text(block, p, text);
            fprintf(page->file, "%s", written++ > 0 ? "<br>" : "");
            write_prose(page->file, text);
        }
    }
    fprintf(page->file, "</dd>\n");
}

static void write_probe(FILE *file, const char *name) {
    fprintf(file, ": <code>hyst record --port DEV --probe %s</code>", name);
}

/* What to do now: with the model, with each finding, and what to record. */
static void write_advice(const page_t *page) {
    const answer_t *answer = page->answer;
    char text[DIAGNOSIS_LINE];
    fprintf(page->file, "<h2>What to do now</h2>\n<ul>\n<li>");
    advice_on_verdict(answer, text);
    write_prose(page->file, text);
    fprintf(page->file, "</li>\n");
    for (size_t f = 0; f < answer->findings; f++) {
        advice_on_block(answer, answer->finding[f].block, text);
        fprintf(page->file, "<li>");
        write_prose(page->file, text);
        if (advice_on_recording(&answer->finding[f], text)) {
            fprintf(page->file, " ");
            write_prose(page->file, text);
            fprintf(page->file, " <code>hyst record --port DEV --probe %s</code>", finding_probe(&answer->finding[f]));
        }
        fprintf(page->file, "</li>\n");
    }
    fprintf(page->file,
            "<li>To check the model, or to go on, record a probe that has a part for each effect: <code>hyst record "
            "--port DEV --probe %s</code></li>\n</ul>\n",
            next_probe(answer));
}

static void write_finding(const page_t *page, size_t index) {
    const finding_t *finding = &page->answer->finding[index];
    char text[DIAGNOSIS_LINE];
    fprintf(page->file, "<h3>%zu. %s (%s)</h3>\n<dl>\n", index + 1, finding->block->name,
            certainty_name(finding->certainty));
    finding_explanation(finding, text);
    write_row(page->file, "What", text);
    write_numbers(page, finding);
    if (finding_times_text(page->answer, finding, text)) {
        write_row(page->file, "Valid", text);
    }
    location_text(&page->account->where[index], page->recordings, page->count, text);
    write_row(page->file, "Where", text);
    if (finding_is_empirical(finding)) {
        fprintf(page->file, "<dt>Held-out error</dt><dd>%.4f %% without it, %.4f %% with it</dd>\n",
                finding->held_out_before_percent, finding->held_out_after_percent);
    } else {
        if (finding->heard) {
            fprintf(page->file,
                    "<dt>Held-out error</dt><dd>%.4f %% without it, %.4f %% with it, beside an operator that imitates "
                    "a hysteresis of any shape</dd>\n",
                    finding->held_out_before_percent, finding->held_out_after_percent);
        }
        fprintf(page->file,
                "<dt>How sure</dt><dd>confidence %.2f; its size is %.3g standard errors, %.3g by the scatter between "
                "blocks of time</dd>\n",
                page->account->confidence[index], fabs(finding->t), fabs(finding->t_blocks));
    }
    fprintf(page->file, "<dt>%s</dt><dd>", excitation_heading(finding));
    write_prose(page->file, block_search(finding->block)->excitation);
    if (finding->certainty != NAMED) {
        write_probe(page->file, finding_probe(finding));
    }
    fprintf(page->file, "</dd>\n");
    if (finding_columns_text(finding, &page->account->measured.finding[index], text)) {
        write_row(page->file, "Measured beside it", text);
    }
    fprintf(page->file, "</dl>\n");
}

/* Measured columns besides drive and displacement, which no model contains. */
static void write_measured(const page_t *page) {
    const measured_columns_t *measured = &page->account->measured;
    const int level = page->answer->findings > 0 ? 3 : 2;
    if (measured->count > 0) {
        fprintf(page->file, "<h%d>What else was measured</h%d>\n", level, level);
    }
    for (size_t c = 0; c < measured->count; c++) {
        char text[DIAGNOSIS_LINE];
        measured_column_text(page->answer, &measured->column[c], text);
        fprintf(page->file, "<p>");
        write_prose(page->file, text);
        fprintf(page->file, "</p>\n");
    }
}

static void write_findings(const page_t *page) {
    const answer_t *answer = page->answer;
    char text[DIAGNOSIS_LINE];
    if (answer->findings > 0) {
        fprintf(page->file, "<h2>%s</h2>\n",
                answer->verdict == UNKNOWN_PHYSICS ? "What comes nearest" : "What was found");
    }
    for (size_t f = 0; f < answer->findings; f++) {
        write_finding(page, f);
    }
    const int level = answer->findings > 0 ? 3 : 2;
    fprintf(page->file, "<h%d>What remains</h%d>\n<p>The model leaves ", level, level);
    remainder_text(answer, text);
    write_prose(page->file, text);
    if (page->account->remaining.somewhere) {
        location_text(&page->account->remaining, page->recordings, page->count, text);
        fprintf(page->file, "; ");
        write_prose(page->file, text);
    }
    fprintf(page->file, ".</p>\n");
}

/* Blocks that were tried and not found, with the detection limit of each. */
static void write_unseen(const page_t *page) {
    const unseen_t *unseen[DIAGNOSIS_MOST_UNSEEN];
    size_t testable;
    const size_t count = unseen_in_order(page->answer, unseen, &testable);
    const bool limits = unseen_has_limits(page->answer);
    if (count > 0) {
        fprintf(page->file, "<details>\n<summary>What would have been seen, and what was not testable</summary>\n<div "
                            "class=\"wide\"><table "
                            "class=\"long words\">\n"
                            "<thead><tr><th>Not found</th><th>Smallest size</th><th>Shows best in</th></tr></thead>\n"
                            "<tbody>\n");
    }
    for (size_t i = 0; i < count; i++) {
        char text[DIAGNOSIS_LINE] = "";
        if (i < testable && limits) {
            unseen_text(unseen[i], text);
        } else if (i < testable) {
            text_append(text, "no limit");
        } else {
            text_append(text, "not testable here: %s", unseen[i]->why);
        }
        fprintf(page->file, "<tr><td>%s</td><td>", unseen[i]->block->name);
        write_prose(page->file, text);
        fprintf(page->file, "</td><td>");
        write_prose(page->file, unseen[i]->block->probe->excitation);
        fprintf(page->file, "</td></tr>\n");
    }
    if (count > 0) {
        fprintf(
            page->file, "</tbody></table></div>\n<p class=\"note\">%s</p>\n</details>\n",
            limits ? "The size is that of the change of the position, by the form of the block that shows best here (a "
                     "time constant, a frequency). What is smaller would not have been told from noise, or from a "
                     "model that is not quite right."
                   : "More than noise remains, and may hide effects of any size.");
    }
}

static void write_considered(const page_t *page) {
    const answer_t *answer = page->answer;
    size_t order[DIAGNOSIS_MOST_CONSIDERED];
    const size_t count = considered_in_order(answer, order);
    fprintf(
        page->file,
        "<details>\n<summary>What else was considered</summary>\n<p class=\"with-next\">Each round asks what one more "
        "block would "
        "explain of what the chain so far leaves; %zu forms of blocks were tried in all.</p>\n<div class=\"wide\">"
        "<table class=\"long\">\n<thead><tr><th>Block</th><th>Round</th><th>Better fit</th><th>Size over its "
        "error</th><th>the same, between blocks of time</th><th class=\"text\">What became of it</th></tr></thead>\n"
        "<tbody>\n",
        answer->tested);
    for (size_t i = 0; i < count; i++) {
        const considered_t *c = &answer->consideration[order[i]];
        fprintf(page->file,
                "<tr><td>%s</td><td>%zu</td><td>%.1f</td><td>%.1f</td><td>%.1f</td><td class=\"text\">%s</td></tr>\n",
                c->block->name, c->round, c->likelihood, c->t, c->t_blocks, outcome_text(answer, order[i]));
    }
    fprintf(page->file,
            "</tbody></table></div>\n<p class=\"note\">Better fit: what the block at its best takes off the squared "
            "error that is left, in units of the noise variance (twice the logarithm of the likelihood ratio), before "
            "the hysteresis is fitted with it: 15 may be chance, and a name has to win by 20 when all is fitted. Size "
            "over its error: how many standard errors it is away from nothing; between blocks of time, with the "
            "error by which its size scatters from one stretch of time to the next.</p>\n</details>\n");
}

static void write_not_looked_for(const page_t *page) {
    size_t written = 0;
    fprintf(page->file, "<details>\n<summary>What was not looked for</summary>\n<p>");
    for (size_t i = 0; i < catalogue_count; i++) {
        if (block_search(catalogue[i]) == NULL && !block_is_hysteresis(catalogue[i])) {
            fprintf(page->file, "%s%s", written++ > 0 ? ", " : "", catalogue[i]->name);
        }
    }
    fprintf(page->file, ". A model may contain them; a diagnosis does not ask for them.</p>\n</details>\n");
}

/* The recording that shows the first finding best, or what remains. */
static size_t shown_recording(const page_t *page) {
    return page->answer->findings > 0 ? page->account->where[0].recording : page->account->remaining.recording;
}

static const noise_t *known_noise(const answer_t *answer) {
    const question_t *question = answer->question;
    return isfinite(answer->noise_percent) && question->noise.sigma_um > 0.0 ? &question->noise : NULL;
}

static double *residual_of(const page_t *page, size_t recording, const double *model_um) {
    const recording_t *r = &page->recordings[recording];
    const size_t from = page->account->from[recording];
    double *x = allocate(r->samples - from, sizeof *x);
    for (size_t k = from; k < r->samples; k++) {
        x[k - from] = r->column[COLUMN_DISPLACEMENT][k] - model_um[k];
    }
    return x;
}

/* What the residual of the shown recording is made of. */
static void write_budget(const page_t *page) {
    enum { LEAST_SAMPLES = 64 };
    const answer_t *answer = page->answer;
    const size_t i = shown_recording(page), from = page->account->from[i];
    const recording_t *r = &page->recordings[i];
    if (r->samples < from + LEAST_SAMPLES) {
        return;
    }
    double *before = residual_of(page, i, (answer->findings > 0 ? page->account->before : page->account->after)[i]);
    double *left = residual_of(page, i, page->account->after[i]);
    budget_input_t input = {.residual_um = before,
                            .left_um = left,
                            .shares = answer->findings,
                            .samples = r->samples - from,
                            .sample_rate_hz = r->sample_rate_hz,
                            .noise = known_noise(answer)};
    for (size_t f = 0; f < answer->findings; f++) {
        input.share_um[f] = page->account->share[f][i] + from;
        input.name[f] = answer->finding[f].block->name;
    }
    fprintf(page->file, "<h2>Noise budget: what the residual is made of</h2>\n");
    noise_budget_write(page->file, &input);
    free(before);
    free(left);
}

/* Frequency response of the shown recording and of the final model. */
static void write_response(const page_t *page) {
    const size_t i = shown_recording(page);
    bode_t bode;
    if (page->looks == NULL) {
        return;
    }
    bode_of_simulated(&page->recordings[i], &page->looks[i].drive, page->account->after[i], &bode);
    if (bode.measured.count >= 2) {
        fprintf(page->file, "<h2>Frequency response</h2>\n");
        bode_write_figures(page->file, &bode);
    }
    bode_free(&bode);
}

static void write_before_and_after(const page_t *page) {
    const account_t *account = page->account;
    const bool found = page->answer->findings > 0;
    const size_t i = shown_recording(page), from = account->from[i];
    const recording_t *r = &page->recordings[i];
    fprintf(page->file, "<h2>%s</h2>\n", found ? "Before and after" : "The model and the recordings");
    write_errors(page);
    if (page->count > 1) {
        fprintf(page->file, "<p class=\"with-next\">Pictures: ");
        write_escaped(page->file, without_folder(r->name));
        fprintf(page->file, ".</p>\n");
    }
    write_pictures(page->file, &(compared_t){.drive_v = r->column[COLUMN_DRIVE] + from,
                                             .measured_um = r->column[COLUMN_DISPLACEMENT] + from,
                                             .before_um = found ? account->before[i] + from : NULL,
                                             .after_um = account->after[i] + from,
                                             .samples = r->samples - from,
                                             .sample_rate_hz = r->sample_rate_hz,
                                             .start_s = r->start_s + (double)from / r->sample_rate_hz,
                                             .noise = known_noise(page->answer)});
}

bool diagnosis_write_report(const answer_t *answer, const account_t *account, const recording_t *recordings,
                            size_t count, const look_t *looks, const char *path, failure_t *failure) {
    output_file_t output;
    if (!page_open(&output, path, "What the model leaves out", failure)) {
        return false;
    }
    const page_t page = {output.file, answer, account, recordings, count, looks};
    char text[DIAGNOSIS_LINE];
    fprintf(page.file, "%s<p class=\"verdict\">", style);
    verdict_sentence(answer, text);
    measured_columns_verdict(answer, &account->measured, text);
    write_prose(page.file, text);
    fprintf(page.file, "</p>\n");
    write_recordings(&page);
    write_advice(&page);
    write_before_and_after(&page);
    write_budget(&page);
    write_response(&page);
    write_chain(&page);
    write_findings(&page);
    write_measured(&page);
    write_considered(&page);
    write_unseen(&page);
    write_not_looked_for(&page);
    return page_close(&output, true, failure);
}
