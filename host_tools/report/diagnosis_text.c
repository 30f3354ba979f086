/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/diagnosis_text.h"
#include "base/quantity.h"
#include "base/shown_name.h"
#include "chain/catalogue.h"
#include "diagnosis/nuisance/hysteresis_numbers.h"
#include "diagnosis/where/cells.h"
#include <math.h>
#include <string.h>

const char *verdict_name(verdict_t verdict) {
    static const char *const names[] = {"nothing missing", "explained", "partly explained", "unknown physics"};
    return names[verdict];
}

const char *certainty_name(certainty_t certainty) {
    static const char *const names[] = {"detected", "isolated", "named"};
    return names[certainty];
}

/* The block accepted in the round, the last if several; NULL: none. */
static const considered_t *taken_in(const answer_t *answer, size_t round) {
    const considered_t *taken = NULL;
    for (size_t i = 0; i < answer->considered; i++) {
        const considered_t *other = &answer->consideration[i];
        taken = other->round == round && other->outcome == TAKEN ? other : taken;
    }
    return taken;
}

/* Whether the block is a rival of the one accepted in its round. */
static bool is_rival(const answer_t *answer, const considered_t *considered) {
    const considered_t *taken = taken_in(answer, considered->round);
    for (size_t f = 0; taken != NULL && f < answer->findings; f++) {
        const finding_t *finding = &answer->finding[f];
        for (size_t r = 0; finding->block == taken->block && r < finding->rivals; r++) {
            if (finding->rival[r] == considered->block) {
                return true;
            }
        }
    }
    return false;
}

const char *outcome_text(const answer_t *answer, size_t index) {
    static const char *const texts[] = {"taken",
                                        "explains less than the best",
                                        "the held-out samples do not support it",
                                        "could be chance, or an error of the model",
                                        "superfluous beside the others, or none of its numbers determined",
                                        "what was measured beside the position contradicts it",
                                        "only comes near, and so do bends of the hysteresis"};
    const considered_t *considered = &answer->consideration[index], *taken = taken_in(answer, considered->round);
    if (considered->outcome == LESS_LIKELY && is_rival(answer, considered)) {
        return "cannot be distinguished from the best";
    }
    if (considered->outcome == LESS_LIKELY && taken != NULL && considered->likelihood > taken->likelihood) {
        return "explains more alone, but less when the hysteresis and what else was found are fitted with it";
    }
    return texts[considered->outcome];
}

const block_t *diagnosis_other_shape(const answer_t *answer) {
    return answer->question->model_given && answer->family != NULL
               ? answer->model.block[hysteresis_index(&answer->model)].block
               : NULL;
}

/* "creep (or dielectric_loss) and resonance" */
static void append_names(const answer_t *answer, char *text) {
    const size_t named = findings_named(answer);
    if (diagnosis_other_shape(answer) != NULL) {
        text_append(text, "%s (%s)%s",
                    model_find(&answer->given, diagnosis_other_shape(answer)->name) != NULL
                        ? "a hysteresis of other numbers"
                        : "another shape of hysteresis",
                    diagnosis_other_shape(answer)->name,
                    named > 1    ? ", "
                    : named == 1 ? " and "
                                 : "");
    }
    for (size_t f = 0; f < named; f++) {
        const finding_t *finding = &answer->finding[f];
        text_append(text, "%s%s", text_between(f, named), finding->block->name);
        for (size_t r = 0; r < finding->rivals; r++) {
            text_append(text, "%s%s", r == 0 ? " (or " : ", ", finding->rival[r]->name);
        }
        text_append(text, "%s", finding->rivals > 0 ? ")" : "");
    }
}

static bool tells_names(const answer_t *answer) {
    return findings_named(answer) > 0 || diagnosis_other_shape(answer) != NULL;
}

/* "the noise is 0.1 %." */
static void append_noise(const answer_t *answer, char *text) {
    if (isfinite(answer->noise_percent)) {
        text_append(text, "the noise is %.3g %%.", answer->noise_percent);
    } else {
        text_append(text, "the noise is not known, as the drive never rests.");
    }
}

/* NULL: none. */
static const finding_t *finding_of_steps(const answer_t *answer) {
    for (size_t f = 0; f < answer->findings; f++) {
        if (answer->finding[f].block->readings == READINGS_STEPPED) {
            return &answer->finding[f];
        }
    }
    return NULL;
}

/* Beside the operator, where what was found was found there. */
static void append_beside_operator(const answer_t *answer, char *text) {
    if (answer_has_heard(answer)) {
        text_append(text, "beside an operator that imitates a hysteresis of any shape from %.3g %% to %.3g %%, ",
                    answer->question->shape.operator_percent, answer->shape_after.operator_percent);
    }
}

/* ": the held-out error falls from 0.9 % to 0.1 %, the noise is 0.1 %." Steps of a converter are found in the readings,
 * and remain in the error. */
static void append_gain(const answer_t *answer, char *text) {
    const finding_t *steps = finding_of_steps(answer);
    const bool other_shape = diagnosis_other_shape(answer) != NULL, more = findings_named(answer) > 1 || other_shape;
    const double before = other_shape ? answer->own_shape_held_out_percent : answer->baseline_held_out_percent;
    const double after = findings_named_held_out_percent(answer);
    if (steps == NULL || more) {
        text_append(text, ": the held-out error %s from %.3g %% to %.3g %%, ", after < before ? "falls" : "goes",
                    before, after);
        append_beside_operator(answer, text);
        append_noise(answer, text);
    }
    if (steps != NULL) {
        text_append(text, "%s readings are multiples of %.4g um, which no model follows.", more ? " The" : ": the",
                    answer->model.block[finding_index(answer, steps)].parameter[0].value[0]);
    }
    if (steps != NULL && !more) {
        text_append(text, " These steps are in the held-out error of %.3g %%; with them ", after);
        append_noise(answer, text);
    }
}

/* Of a given chain: its terms explain nothing, whatever is found beside them. */
static void append_given_terms(const answer_t *answer, char *text) {
    for (size_t b = 0; answer->question->model_given && b < answer->given.blocks; b++) {
        const block_t *block = answer->given.block[b].block;
        if (block->empirical != NULL) {
            text_append(text, "%sThe given chain has a term without a cause, %s: what that describes is not explained.",
                        text[0] != '\0' ? " " : "", block->name);
        }
    }
}

static bool leaves_samples_out(const question_t *question) {
    bool some = false;
    for (size_t i = 0; i < question->samples.count; i++) {
        some = some || question->samples.recordings[i].masked != NULL;
    }
    return some;
}

/* No model is worth anything that delivers more error than a plain one. Of the whole recording, with readings that say
 * nothing, that is no question. */
static void append_plain(const answer_t *answer, char *text) {
    if (leaves_samples_out(answer->question)) {
        return;
    }
    const bool line = answer->line_percent < answer->plays_percent;
    const double plain = line ? answer->line_percent : answer->plays_percent;
    if (plain < answer->delivered_percent) {
        text_append(text, "%sOf the whole recording the model leaves %.3g %%, and %s alone %.3g %%.",
                    text[0] != '\0' ? " " : "", answer->delivered_percent,
                    line ? "a straight line" : "30 play operators", plain);
    }
}

/* Functions of the drive's extremes explain whatever comes while these grow. */
static void append_past(const answer_t *answer, char *text) {
    if (answer_rests_on_past(answer)) {
        text_append(
            text,
            "%s%.2g %% of the stroke were put down to what drives before the recording left, more than all that "
            "remains; a drift, or whatever else is slow, would look the same.",
            text[0] != '\0' ? " " : "", answer->past_percent);
    }
}

bool verdict_caveat(const answer_t *answer, char text[DIAGNOSIS_LINE]) {
    const size_t reversals = answer_reversals(answer);
    text[0] = '\0';
    if (answer_has_too_little(answer)) {
        text_append(text,
                    "Too little to go by: the drive turns round %zu time%s by more than half of its range, and a "
                    "hysteresis of which nothing comes again may be any.",
                    reversals, reversals == 1 ? "" : "s");
    }
    if (answer->question->seen.added_noise_percent > 0.0) {
        text_append(text,
                    "%sThe readings have no noise, as those of a simulation: white noise of %g %% of the stroke was "
                    "added, as everything is judged by it.",
                    text[0] != '\0' ? " " : "", answer->question->seen.added_noise_percent);
    }
    append_given_terms(answer, text);
    append_past(answer, text);
    append_plain(answer, text);
    return text[0] != '\0';
}

/* What is noise shows in a rest and between passes; here, in what the recordings do not have of these. */
static const char *what_would_tell(const probe_seen_t *seen) {
    return seen->rests && seen->repeats ? ""
           : seen->rests                ? " A path that repeats itself would tell which."
           : seen->repeats              ? " A rest would tell which."
                                        : " A rest, or a path that repeats itself, would tell which.";
}

/* How much of the error only another shape of hysteresis explains. Beside 1/f noise the operator may leave what the
 * model does, and then has called noise what may as well be creep or a drift. what: "the model leaves" */
static void append_shape(const answer_t *answer, const char *what, char *text) {
    const shape_t *shape = &answer->shape_after;
    if (shape->operator_percent >= answer->held_out_percent && shape->rho_hz > 0.0) {
        text_append(text,
                    " What %s, %.3g %%, is 1/f below %.3g Hz: noise, or something slow, as creep or a drift. An "
                    "operator that imitates a hysteresis of any shape leaves no less, %.3g %%.%s",
                    what, answer->held_out_percent, shape->rho_hz, shape->operator_percent,
                    what_would_tell(&answer->question->seen));
        return;
    }
    text_append(text,
                " What %s beside noise is a hysteresis of another shape, the shape of its loops: an operator that "
                "imitates a hysteresis of any shape leaves nothing but noise",
                what);
    if (shape->operator_percent < answer->held_out_percent) {
        text_append(text, ", %.3g %% of samples that no fit saw, the model %.3g %%", shape->operator_percent,
                    answer->held_out_percent);
    }
    text_append(text, ".");
    if (answer->findings == 0 && !shape->silent && shape->loudest != NULL) {
        text_append(text, " Beside it speaks %s%s.", shape->loudest->name,
                    shape->loudest->probe->shape ? ": a bend, of the loops or of the readings"
                                                 : ", but for no more than the operator itself may be off by");
    }
}

/* What the look shows and nothing in the answer explains. */
static void append_seen(const answer_t *answer, char text[DIAGNOSIS_LINE]) {
    const probe_seen_t *seen = &answer->question->seen;
    if (answer->ring_left_um > 0.0) {
        text_append(text,
                    " After %s of the drive the position rings at %.4g Hz with damping %.2g, %.3g um at first, and "
                    "nothing in this answer does.",
                    seen->rings > 1 ? "steps" : "a step", seen->ring_hz, seen->ring_damping, answer->ring_left_um);
    }
}

/* " No known effect fits what is left; empirical_curve describes it, without a cause: ..." */
static void append_terms(const answer_t *answer, char *text) {
    const size_t named = findings_named(answer), terms = answer->findings - named;
    if (terms == 0) {
        return;
    }
    text_append(text, " No known effect fits what is left; ");
    for (size_t t = 0; t < terms; t++) {
        text_append(text, "%s%s", text_between(t, terms), answer->finding[named + t].block->name);
    }
    text_append(text, " describe%s it, without a cause: the held-out error falls from %.3g %% to %.3g %%.",
                terms > 1 ? "" : "s", findings_named_held_out_percent(answer), answer->held_out_percent);
}

void verdict_sentence(const answer_t *answer, char text[DIAGNOSIS_LINE]) {
    text_append(text, "%s", verdict_caveat(answer, text) ? " As far as it goes: " : "");
    switch (answer->verdict) {
    case NOTHING_MISSING:
        if (answer->another_shape) {
            text_append(text, "Nothing is missing that these recordings could show.");
            append_shape(answer, "the model leaves", text);
            return;
        }
        text_append(text, "Nothing is missing that these recordings could show: what the model leaves%s is noise.",
                    answer->question->model_given ? ", fitted again," : "");
        return;
    case UNKNOWN_PHYSICS:
        text_append(text,
                    "Unknown physics: the model leaves more than noise, and no block of the catalogue explains it.%s",
                    tells_names(answer) ? " What comes nearest is " : "");
        break;
    case EXPLAINED:
        text_append(text, "Explained by ");
        break;
    case PARTLY_EXPLAINED:
        text_append(text, "Partly explained by ");
        break;
    }
    if (tells_names(answer)) {
        append_names(answer, text);
        append_gain(answer, text);
        text_append(text, "%s",
                    answer->verdict == PARTLY_EXPLAINED
                        ? " What remains is more than noise, and in no block of the catalogue."
                        : "");
        if (answer->verdict == EXPLAINED && answer->another_shape) {
            append_shape(answer, "remains", text);
        }
        if (answer->verdict == PARTLY_EXPLAINED && answer->another_shape &&
            answer->shape_after.operator_percent < answer->held_out_percent) {
            text_append(text,
                        " A part of it is the shape of the loops: an operator that imitates a hysteresis of any shape "
                        "leaves %.3g %% of samples that no fit saw, the model %.3g %%.",
                        answer->shape_after.operator_percent, answer->held_out_percent);
        }
    }
    append_seen(answer, text);
    append_terms(answer, text);
}

void finding_explanation(const finding_t *finding, char text[DIAGNOSIS_LINE]) {
    text[0] = '\0';
    if (finding->certainty == DETECTED && finding->rivals == 0 && !finding_is_empirical(finding)) {
        text_append(text, "It comes nearest to what is missing, and does not explain it. If it were the reason: ");
    }
    if (finding->certainty != NAMED && finding->rivals > 0) {
        const size_t all = finding->rivals + 1;
        text_append(text, "One of %s", finding->block->name);
        for (size_t r = 0; r < finding->rivals; r++) {
            text_append(text, "%s%s", text_between(r + 1, all), finding->rival[r]->name);
        }
        text_append(text, "; these recordings cannot tell which%s. The numbers are those of %s: ",
                    finding->certainty == DETECTED ? ", and they are not alike" : "", finding->block->name);
    }
    text_append(text, "%s", block_search(finding->block)->explanation);
    if (finding->heard) {
        text_append(text, " It was found beside an operator that imitates a hysteresis of any shape, and so were its "
                          "numbers; the model's own hysteresis has another shape.");
    } else if (finding_has_reservation(finding)) {
        text_append(text, "%s",
                    finding->block->modifies_hysteresis
                        ? " Another bend of the hysteresis may be the reason in its place."
                    : finding->shape ? " A bend of the hysteresis itself may be the reason in its place."
                                     : " More than noise remains, which may be the reason in its place.");
    }
}

bool finding_times_text(const answer_t *answer, const finding_t *finding, char text[DIAGNOSIS_LINE]) {
    double time_s[2];
    text[0] = '\0';
    if (!finding_times(answer, finding, time_s)) {
        return false;
    }
    char from[QUANTITY_TEXT], to[QUANTITY_TEXT];
    quantity_named(from, "", "s", time_s[0], 2);
    quantity_named(to, "", "s", time_s[1], 3);
    text_append(text, "from %s to %s after a step: what is quicker or slower these recordings do not show", from, to);
    return true;
}

/* "12 .. 14 and 30 .. 31 s", at most a few ranges. On a linear scale to a fifth of each, wherever 0 is: times may be
 * those since 1970. */
static void append_ranges(char *text, const ranges_t *all, double (*gap)(const range_t *, const range_t *),
                          const char *unit) {
    enum { MOST_TOLD = 3 };
    const ranges_t told = ranges_bridged(all, gap, MOST_TOLD);
    char range[QUANTITY_TEXT];
    for (size_t i = 0; i < told.count; i++) {
        const double from = told.range[i].from, to = told.range[i].to;
        quantity_range(range, from, to, gap == cells_linear_gap ? (to - from) / 5.0 : 0.0);
        text_append(text, "%s%s", text_between(i, told.count), range);
    }
    text_append(text, " %s", unit);
}

/* "where the drive rests and at 100 .. 200 V/s" */
static void append_rates(char *text, const ranges_t *rates) {
    const bool rest = rates->count > 0 && rates->range[0].to == 0.0;
    ranges_t moving = {.count = 0};
    for (size_t i = rest ? 1 : 0; i < rates->count; i++) {
        moving.range[moving.count++] = rates->range[i];
    }
    text_append(text, "%s%s", rest ? "where the drive rests" : "", rest && moving.count > 0 ? " and at " : "");
    if (moving.count > 0) {
        append_ranges(text, &moving, cells_octave_gap, "V/s");
    }
    text_append(text, "; ");
}

/* A single range that is nearly all of the recording says nothing. */
static bool is_whole(const ranges_t *ranges, double low, double high) {
    static const double nearly = 0.04; /* a location is found in cells of a twenty-fourth of the range */
    const double margin = nearly * (high - low);
    return ranges->count == 1 && ranges->range[0].from <= low + margin && ranges->range[0].to >= high - margin;
}

static void append_part(char *text, const char *separator) {
    const size_t length = strlen(text);
    if (length > 0 && strcmp(text + length - 2, "; ") != 0) {
        text_append(text, "%s", separator);
    }
}

void location_text(const location_t *location, const recording_t *recordings, size_t count, char text[DIAGNOSIS_LINE]) {
    const recording_t *recording = &recordings[location->recording];
    text[0] = '\0';
    if (!location->somewhere) {
        text_append(text, "nowhere above the noise");
        return;
    }
    text_append(text, "%s%s; ", location->loop == LOOP_EVERYWHERE ? "in all parts of the loop" : "mostly ",
                location->loop == LOOP_TURNING_POINTS ? "around turning points"
                : location->loop == LOOP_MID_BRANCH   ? "in mid branch"
                : location->loop == LOOP_HOLDS        ? "during holds"
                                                      : "");
    const double end_s = recording->start_s + (double)recording->samples / recording->sample_rate_hz;
    double drive_v[2];
    values_range(recording->column[COLUMN_DRIVE], recording->samples, drive_v);
    if (!location->drive_v.whole && !is_whole(&location->drive_v, drive_v[0], drive_v[1])) {
        append_ranges(text, &location->drive_v, cells_linear_gap, "V; ");
    }
    if (!location->drive_rate_v_per_s.whole) {
        append_rates(text, &location->drive_rate_v_per_s);
    }
    if (location->frequency_hz.whole) {
        text_append(text, "at all frequencies");
    } else {
        append_ranges(text, &location->frequency_hz, cells_octave_gap, "Hz");
    }
    for (size_t i = 0; i < location->harmonics; i++) {
        text_append(text, "%s%u", i == 0 ? " (harmonics " : text_between(i, location->harmonics),
                    location->harmonic[i]);
    }
    text_append(text, "%s", location->harmonics > 0 ? ")" : "");
    if (location->time_s.whole || is_whole(&location->time_s, recording->start_s, end_s)) {
        append_part(text, "; ");
        text_append(text, "all the time");
    } else {
        append_part(text, "; ");
        append_ranges(text, &location->time_s, cells_linear_gap, "s");
    }
    if (count > 1) {
        text_append(text, " of %s", without_folder(recording->name));
    }
}

void parameter_text(const model_block_t *block, size_t parameter, char text[DIAGNOSIS_LINE]) {
    const parameter_info_t *info = &block->block->parameter[parameter];
    const double value = block->parameter[parameter].value[0];
    const double sigma = block->parameter[parameter].sigma != NULL ? block->parameter[parameter].sigma[0] : HUGE_VAL;
    char number[QUANTITY_TEXT];
    quantity_text(number, info->name, info->unit, value, sigma);
    text[0] = '\0';
    text_append(text, "%s", number);
    if (!isfinite(sigma) || !(sigma > 0.0)) {
        text_append(text, " (%s)", info->chosen ? "chosen" : sigma == 0.0 ? "at its bound" : "not determined");
    }
}

void remainder_text(const answer_t *answer, char text[DIAGNOSIS_LINE]) {
    const remainder_t *remainder = &answer->remainder;
    char range[QUANTITY_TEXT];
    text[0] = '\0';
    if (remainder->rms_um > 0.0) {
        quantity_range(range, remainder->low_hz, remainder->high_hz, 0.0);
        text_append(text, "%.2g um rms beside the noise, most of it at %s Hz", remainder->rms_um, range);
    } else {
        text_append(text, "noise at all frequencies");
    }
    if (remainder->outliers > 0) {
        text_append(text, "; %zu single sample%s far outside the noise", remainder->outliers,
                    remainder->outliers == 1 ? "" : "s");
    }
    if (remainder->by_level.part > 0.0) {
        quantity_range(range, remainder->by_level.low_um, remainder->by_level.high_um, 0.0);
        text_append(text, "; %.2g of the noise goes with the position, most of it at %s um", remainder->by_level.part,
                    range);
    }
    if (!remainder->structured &&
        (remainder->rms_um > 0.0 || remainder->outliers > 0 || remainder->by_level.part > 0.0)) {
        text_append(text, ": too little to ask for a reason");
    }
}

/* Appends the blocks of the catalogue that were not found and are, or are not, testable. */
static size_t add_unseen(const answer_t *answer, bool testable, const unseen_t **unseen, size_t count) {
    for (size_t c = 0; c < catalogue_count; c++) {
        for (size_t i = 0; i < answer->unseen_count; i++) {
            const unseen_t *u = &answer->unseen[i];
            if (u->block == catalogue[c] && u->testable == testable && !finding_may_be(answer, u->block)) {
                unseen[count++] = u;
            }
        }
    }
    return count;
}

size_t considered_in_order(const answer_t *answer, size_t order[DIAGNOSIS_MOST_CONSIDERED]) {
    size_t count = 0;
    for (size_t round = 1; round <= answer->rounds; round++) {
        for (int taken = 1; taken >= 0; taken--) {
            for (size_t i = 0; i < answer->considered; i++) {
                const considered_t *c = &answer->consideration[i];
                if (c->round == round && (c->outcome == TAKEN) == (taken == 1)) {
                    order[count++] = i;
                }
            }
        }
    }
    return count;
}

const char *finding_standing(const answer_t *answer, const finding_t *finding) {
    if (finding_is_empirical(finding)) {
        return "describes it, without a cause";
    }
    if (finding->certainty == DETECTED && (answer->verdict == UNKNOWN_PHYSICS || finding->rivals == 0)) {
        return "comes nearest, does not explain it";
    }
    return finding->rivals > 0 ? "found; or a block it is confused with" : "found";
}

const char *excitation_heading(const finding_t *finding) {
    return finding_is_empirical(finding) ? "To find the cause, record"
           : finding->certainty == NAMED ? "Shows best in"
           : finding->rivals > 0         ? "To tell them apart, record"
                                         : "To see more of it, record";
}

size_t unseen_in_order(const answer_t *answer, const unseen_t *unseen[DIAGNOSIS_MOST_UNSEEN], size_t *testable) {
    *testable = add_unseen(answer, true, unseen, 0);
    return add_unseen(answer, false, unseen, *testable);
}

bool unseen_has_parameter(const unseen_t *unseen) {
    return unseen->parameter < unseen->block->parameters && unseen->value != 0.0;
}

void unseen_text(const unseen_t *unseen, char text[DIAGNOSIS_LINE]) {
    char number[QUANTITY_TEXT];
    text[0] = '\0';
    text_append(text, "%.2g um rms", unseen->smallest_um);
    if (unseen_has_parameter(unseen)) {
        const parameter_info_t *info = &unseen->block->parameter[unseen->parameter];
        quantity_named(number, info->name, info->unit, fabs(unseen->value), 2);
        text_append(text, " (%s)", number);
    }
}

bool unseen_has_limits(const answer_t *answer) {
    return !something_remains(answer);
}

const char *errors_caveat(const answer_t *answer) {
    return answer->question->samples.past_matters
               ? "Errors are those beyond what drives before the recording left in it, which it does not erase: a "
                 "function of the highest and the lowest drive since it began. How much that is stands below."
               : NULL;
}

const char *finding_probe(const finding_t *finding) {
    return finding_is_empirical(finding) ? "all" : finding->block->name;
}

const char *next_probe(const answer_t *answer) {
    for (size_t f = 0; f < answer->findings; f++) {
        if (answer->finding[f].certainty != NAMED) {
            return finding_probe(&answer->finding[f]);
        }
    }
    return "all";
}

bool refitted_text(const answer_t *answer, const block_t *block, size_t parameter, char text[DIAGNOSIS_LINE]) {
    const model_block_t *was = model_find(&answer->given, block->name), *is = model_find(&answer->model, block->name);
    char number[DIAGNOSIS_LINE], before[QUANTITY_TEXT];
    text[0] = '\0';
    if (!refitted_changed(was, is, parameter)) {
        return false;
    }
    parameter_text(is, parameter, number);
    quantity_named(before, "", block->parameter[parameter].unit, was->parameter[parameter].value[0], 5);
    text_append(text, "%s in the given chain: %s, it was %s", block->name, number, before);
    return true;
}
