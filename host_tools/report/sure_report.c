/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/sure_report.h"
#include "base/quantity.h"
#include "report/text_line.h"

/* "With creep at 3 times its detection limit (gamma per decade 0.0004)". */
static void append_hidden(const sure_question_t *q, char text[DIAGNOSIS_LINE]) {
    if (q->hidden == NULL) {
        text_append(text, "With nothing missing");
    } else if (q->limits > 0.0) {
        const parameter_info_t *info = &q->hidden->parameter[q->parameter];
        char number[QUANTITY_TEXT];
        quantity_named(number, info->name, info->unit, q->value, 2);
        text_append(text, "With %s at %s its detection limit (%s)", q->hidden->name,
                    q->limits < 1.0 ? "a third of" : "three times", number);
    } else if (q->hidden == q->in_place_of) {
        text_append(text, "With %s, as the answer says", q->hidden->name);
    } else {
        text_append(text, "Had it been %s and not %s", q->hidden->name, q->in_place_of->name);
    }
}

static void append_counts(const sure_question_t *q, size_t each, char text[DIAGNOSIS_LINE]) {
    if (q->hidden == NULL) {
        text_append(text, ": of %zu, %zu were answered by nothing missing", each, q->right);
    } else {
        text_append(text, ": of %zu, %zu were answered so, %zu as one of several that it is among, %zu by nothing",
                    each, q->right, q->open, q->nothing);
    }
    for (size_t i = 0; i < q->others; i++) {
        text_append(text, ", %zu as %s", q->other[i].count, q->other[i].block->name);
    }
    text_append(text, ".");
}

void sure_print(FILE *file, const sure_t *sure) {
    char text[DIAGNOSIS_LINE] = "";
    text_append(
        text,
        "Recordings like these were simulated, %zu of each kind, with this drive and noise (seed %lu), and asked "
        "again.",
        sure->each, sure->seed);
    if (!sure->whole) {
        text_append(text, " What remains unexplained is not in them: answers to them are surer than this one.");
    }
    if (sure->columns) {
        text_append(text, " They have drive and position only.");
    }
    text_wrapped(file, "sure", text);
    for (size_t i = 0; i < sure->count; i++) {
        text[0] = '\0';
        append_hidden(&sure->question[i], text);
        append_counts(&sure->question[i], sure->each, text);
        text_wrapped(file, "", text);
    }
}

static json_t *question_to_json(const sure_question_t *q, size_t each) {
    json_t *others = json_object();
    for (size_t i = 0; i < q->others; i++) {
        json_object_set_new(others, q->other[i].block->name, json_integer((json_int_t)q->other[i].count));
    }
    json_t *parameter = q->limits > 0.0 ? json_pack("{s:s, s:f, s:s}", "name", q->hidden->parameter[q->parameter].name,
                                                    "value", q->value, "unit", q->hidden->parameter[q->parameter].unit)
                                        : json_null();
    return json_pack(
        "{s:s?, s:s?, s:o, s:o, s:i, s:i, s:i, s:i, s:o}", "hidden", q->hidden != NULL ? q->hidden->name : NULL,
        "in_place_of", q->in_place_of != NULL ? q->in_place_of->name : NULL, "detection_limits",
        q->limits > 0.0 ? json_real(q->limits) : json_null(), "parameter", parameter, "simulated", (int)each, "right",
        (int)q->right, "left_open", (int)q->open, "nothing", (int)q->nothing, "others", others);
}

json_t *sure_to_json(const sure_t *sure) {
    json_t *questions = json_array();
    for (size_t i = 0; i < sure->count; i++) {
        json_array_append_new(questions, question_to_json(&sure->question[i], sure->each));
    }
    return json_pack("{s:I, s:i, s:b, s:o}", "seed", (json_int_t)sure->seed, "simulated_each", (int)sure->each,
                     "like_the_recordings", (int)(sure->whole && !sure->columns), "questions", questions);
}
