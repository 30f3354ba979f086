/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/measured_columns_text.h"
#include "base/json_output.h"
#include "base/quantity.h"
#include "diagnosis/account/account.h"
#include <math.h>

static const char *unit_of(column_t column) {
    return column == COLUMN_TEMPERATURE ? "um/K" : column == COLUMN_CURRENT ? "um/A" : "1";
}

/* "0.51 +- 0.02 um/K, behind it by a lag of 3 s" */
static void append_coefficient(char *text, column_t column, const column_relation_t *relation) {
    char number[QUANTITY_TEXT];
    quantity_text(number, "", unit_of(column), relation->coefficient, relation->sigma);
    text_append(text, "%s%s", number, column == COLUMN_VOLTAGE ? " of what the model makes of the difference" : "");
    if (relation->lag_s > 0.0) {
        text_append(text, ", behind it by a lag of about %.2g s", relation->lag_s);
    }
}

/* "the temperature", with which the residual correlates. */
static const char *subject_of(column_t column) {
    return column == COLUMN_VOLTAGE   ? "the measured voltage where it differs from the simulated one"
           : column == COLUMN_CURRENT ? "what capacitance and conductance do not explain of the current"
                                      : "the temperature";
}

static void append_share(char *text, const column_relation_t *relation) {
    text_append(text, ", which explains %.0f %% of its square on the held-out samples.", 100.0 * relation->share);
}

static void append_before(char *text, const char *leaves, column_t column, const column_relation_t *before) {
    if (before->relation != GOES_WITH_NOTHING) {
        text_append(text, "%s %s %s: ", leaves, before->relation == GOES_WITH_IT ? "goes with" : "looks like",
                    subject_of(column));
        append_coefficient(text, column, before);
        append_share(text, before);
        if (before->relation == LOOKS_LIKE_IT) {
            text_append(text, " But the %s only drifts here, and cannot be distinguished from any other slow drift.",
                        column_name(column));
        }
    } else if (!isfinite(before->least)) {
        text_append(text, "The %s says nothing here: it hardly varies, or there are too few samples.",
                    column_name(column));
    } else {
        text_append(text, "%s does not go with %s", leaves, subject_of(column));
        if (column != COLUMN_VOLTAGE) {
            text_append(text, "; %.2g %s would have been seen", before->least, unit_of(column));
        }
        text_append(text, ".");
    }
}

void measured_column_text(const answer_t *answer, const measured_column_t *column, char text[DIAGNOSIS_LINE]) {
    const column_relation_t *before = &column->before, *after = &column->after;
    const bool found = answer->findings > 0;
    text[0] = '\0';
    append_before(text, found ? "What the baseline leaves" : "What the model leaves", column->column, before);
    if (found && after->relation != GOES_WITH_NOTHING) {
        text_append(text, " What remains in the end %s it, ",
                    after->relation == GOES_WITH_IT ? "goes with" : "looks like");
        append_coefficient(text, column->column, after);
        append_share(text, after);
    } else if (found && before->relation != GOES_WITH_NOTHING) {
        text_append(text, " With what was found, nothing of that remains.");
    }
    if (column->column == COLUMN_VOLTAGE && after->relation == GOES_WITH_IT && after->coefficient > 0.5) {
        text_append(text, " Something is missing in the amplifier, before the voltage is measured.");
    }
}

/* "(0.99 +- 0.01 of it)" */
static void append_part(char *text, const electrical_change_t *change, const char *of) {
    char part[QUANTITY_TEXT];
    quantity_text(part, "", "1", change->part, fmax(change->sigma, electrical_least_sigma));
    text_append(text, " (%s of %s)", part, of);
}

static void append_change(char *text, const finding_t *finding, const finding_columns_t *columns, column_t column) {
    const electrical_change_t *seen = column == COLUMN_VOLTAGE ? &columns->voltage : &columns->current;
    const bool other = columns->block != finding->block; /* the columns belong to another block */
    const char *of = other ? "what such a low pass in the amplifier would do to it" : "what the block does to it";
    const char *space = text[0] != '\0' ? " " : "", *name = column_name(column);
    switch (electrical_verdict(seen)) {
    case CHANGE_NOT_SEEN:
        break;
    case CHANGE_PRESENT:
        text_append(text, "%sThe measured %s shows it", space, name);
        append_part(text, seen, of);
        text_append(text, "%s",
                    other ? ": the amplifier lags as well."
                    : electrical_only_part(seen)
                        ? ": only that part of it is in the amplifier, something behind it acts alike."
                        : ": it is in the amplifier.");
        break;
    case CHANGE_ABSENT:
        text_append(text, "%sThe measured %s does not show it", space, name);
        append_part(text, seen, of);
        text_append(text, ": it is behind the amplifier.");
        break;
    case CHANGE_TOO_LARGE:
        text_append(text, "%sThe measured %s decides nothing: it changes by more than the position allows", space,
                    name);
        append_part(text, seen, of);
        text_append(text, ", so its measurement has a lag of its own.");
        break;
    case CHANGE_UNDECIDED:
        text_append(text, "%sThe measured %s does not decide whether it is in the amplifier", space, name);
        append_part(text, seen, of);
        text_append(text, ".");
        break;
    }
}

bool finding_columns_text(const finding_t *finding, const finding_columns_t *columns, char text[DIAGNOSIS_LINE]) {
    text[0] = '\0';
    append_change(text, finding, columns, COLUMN_VOLTAGE);
    append_change(text, finding, columns, COLUMN_CURRENT);
    if (electrical_verdict(&columns->beside_temperature) == CHANGE_ABSENT) {
        text_append(text, "%sThe temperature explains it", text[0] != '\0' ? " " : "");
        append_part(text, &columns->beside_temperature, "it stands beside the temperature");
        text_append(text, finding_contradicted(finding, columns)
                              ? ": this block only looks like what the temperature does."
                              : ": it follows the thermometer.");
    }
    return text[0] != '\0';
}

static json_t *relation_to_json(const column_relation_t *relation) {
    static const char *const names[] = {"none", "looks like it", "goes with it"};
    return json_pack("{s:s, s:o, s:o, s:f, s:f, s:o}", "relation", names[relation->relation], "coefficient",
                     json_number_or_null(relation->coefficient), "sigma", json_number_or_null(relation->sigma), "lag_s",
                     relation->lag_s, "share", relation->share, "least", json_number_or_null(relation->least));
}

json_t *measured_columns_to_json(const measured_columns_t *measured) {
    json_t *list = json_array();
    for (size_t c = 0; c < measured->count; c++) {
        const measured_column_t *column = &measured->column[c];
        json_array_append_new(list, json_pack("{s:s, s:s, s:o, s:o}", "column", column_name(column->column), "unit",
                                              unit_of(column->column), "before", relation_to_json(&column->before),
                                              "after", relation_to_json(&column->after)));
    }
    return list;
}

static void add_change(json_t *json, const char *name, const electrical_change_t *change) {
    static const char *const names[] = {"", "undecided", "present", "absent", "too large"};
    const change_verdict_t verdict = electrical_verdict(change);
    if (verdict != CHANGE_NOT_SEEN) {
        json_object_set_new(
            json, name,
            json_pack("{s:f, s:f, s:s}", "part", change->part, "sigma", change->sigma, "verdict", names[verdict]));
    }
}

void measured_columns_verdict(const answer_t *answer, const measured_columns_t *measured, char text[DIAGNOSIS_LINE]) {
    bool first = true;
    for (size_t c = 0; c < measured->count; c++) {
        if (something_remains(answer) && measured->column[c].after.relation == GOES_WITH_IT) {
            text_append(text, "%s the %s", first ? " But it goes with" : " and",
                        column_name(measured->column[c].column));
            first = false;
        }
    }
    text_append(text, "%s", first ? "" : ".");
}

json_t *finding_columns_to_json(const finding_columns_t *columns) {
    json_t *json = json_object();
    add_change(json, column_name(COLUMN_VOLTAGE), &columns->voltage);
    add_change(json, column_name(COLUMN_CURRENT), &columns->current);
    if (json_object_size(json) > 0) {
        json_object_set_new(json, "of_block", json_string(columns->block->name));
    }
    add_change(json, "beside_temperature", &columns->beside_temperature);
    if (json_object_size(json) == 0) {
        json_decref(json);
        json = NULL;
    }
    return json;
}
