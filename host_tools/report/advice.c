/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/advice.h"
#include "base/shown_name.h"
#include "diagnosis/answer/answer.h"
#include <string.h>

/* How a line of a shell would name the model. */
static const char *model_file(const answer_t *answer) {
    const char *path = answer->written_to;
    return path != NULL && shown_name(path) == path ? path : "BETTER.json";
}

static void use_the_better(const answer_t *answer, char text[DIAGNOSIS_LINE]) {
    if (answer->written_to != NULL) {
        text_append(text, "Use the better model, which was written to %s.", shown_name(answer->written_to));
    } else {
        text_append(text, "Use the better model, which hyst diagnose writes with -o BETTER.json.");
    }
}

void advice_on_verdict(const answer_t *answer, char text[DIAGNOSIS_LINE]) {
    text[0] = '\0';
    if (answer_has_too_little(answer)) {
        text_append(text,
                    "Record more, and diagnose again: a drive that turns round several times, by most of its range.");
        return;
    }
    if (answer_rests_on_past(answer) && answer->verdict != UNKNOWN_PHYSICS) {
        text_append(text, "Record again, with a sweep of the whole range at the beginning; or say in the header key "
                          "drive_before_v what the drive was before, and diagnose again.");
        return;
    }
    switch (answer->verdict) {
    case NOTHING_MISSING:
        text_append(text, "Use the model. Before you rely on it elsewhere, see below which effects these recordings "
                          "would have shown, and which not.");
        return;
    case EXPLAINED:
    case PARTLY_EXPLAINED:
        if (answer_has_heard(answer) && answer->held_out_percent >= answer->baseline_held_out_percent) {
            text_append(text, "Trust the numbers of what was found, and not the model's error: its hysteresis has "
                              "another shape, and is no better beside it.");
        } else {
            use_the_better(answer, text);
        }
        if (answer->verdict == PARTLY_EXPLAINED) {
            text_append(text, " Something else is there, too.");
        }
        return;
    default:
        text_append(text, "Do not trust these names or numbers. See where it is, and check the set-up.");
    }
}

void advice_on_block(const answer_t *answer, const block_t *block, char text[DIAGNOSIS_LINE]) {
    text[0] = '\0';
    if (block->compile != NULL) {
        text_append(text, "%s: the amplifier undoes it (hyst compile %s, then hyst push).", block->name,
                    model_file(answer));
    } else {
        text_append(text, "%s: the amplifier cannot undo it, %s.", block->name, block->uncorrected);
    }
}

bool advice_on_recording(const finding_t *finding, char text[DIAGNOSIS_LINE]) {
    text[0] = '\0';
    if (finding->certainty == NAMED) {
        return false;
    }
    if (finding_is_empirical(finding)) {
        text_append(text, "To find the cause of what it describes, record %s:", finding->block->empirical->excitation);
        return true;
    }
    text_append(text, "Record %s. It would tell ", finding->block->probe->excitation);
    if (finding->rivals > 0) {
        text_append(text, "%s from ", finding->block->name);
        for (size_t i = 0; i < finding->rivals; i++) {
            text_append(text, "%s%s", text_between(i, finding->rivals), finding->rival[i]->name);
        }
    } else {
        text_append(text, "whether it is %s", finding->block->name);
    }
    text_append(text, ":");
    return true;
}
