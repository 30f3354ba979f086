/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/advice.h"
#include "diagnosis/answer/answer.h"
#include <string.h>

const char *advice_on_verdict(const answer_t *answer) {
    if (answer_has_too_little(answer)) {
        return "Record more, and diagnose again: a drive that turns round several times, by most of its range.";
    }
    if (answer_rests_on_past(answer) && answer->verdict != UNKNOWN_PHYSICS) {
        return "Record again, with a sweep of the whole range at the beginning; or say in the header key "
               "drive_before_v "
               "what the drive was before, and diagnose again.";
    }
    switch (answer->verdict) {
    case NOTHING_MISSING:
        return "Use the model. Before you rely on it elsewhere, see below which effects these recordings would have "
               "shown, and which not.";
    case EXPLAINED:
        if (answer_has_heard(answer) && answer->held_out_percent >= answer->baseline_held_out_percent) {
            return "Trust the numbers of what was found, and not the model's error: its hysteresis has another shape, "
                   "and is no better beside it.";
        }
        return "Use the better model, which hyst diagnose writes with -o BETTER.json.";
    case PARTLY_EXPLAINED:
        return "Use the better model, which hyst diagnose writes with -o BETTER.json. Something else is there, too.";
    default:
        return "Do not trust these names or numbers. See where it is, and check the set-up.";
    }
}

void advice_on_block(const block_t *block, char text[DIAGNOSIS_LINE]) {
    text[0] = '\0';
    if (block->compile != NULL) {
        text_append(text, "%s: the amplifier undoes it (hyst compile BETTER.json, then hyst push).", block->name);
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
