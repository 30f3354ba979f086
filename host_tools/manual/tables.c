/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/stages.h"
#include "manual/manual.h"
#include "thresholds/thresholds.h"

static const char *moved_text(threshold_moved_t moved) {
    static const char *const texts[] = {
        [WHOLE] = "the number", [BELOW_ONE] = "what it is short of 1", [ABOVE_ONE] = "what it exceeds 1 by"};
    return texts[moved];
}

void manual_thresholds(FILE *out) {
    size_t count = 0;
    for (size_t i = 0; i < threshold_row_count; i++) {
        count += threshold_rows[i].topic == NULL ? 1 : 0;
    }
    fprintf(out,
            "<!-- Written by the program hyst_manual from host_tools/thresholds/thresholds.def; "
            "`cmake --build` target `documents_update` renews it. -->\n"
            "# Thresholds\n\n"
            "The %zu numbers that `hyst look` and `hyst diagnose` decide by. Each has its reason, and what becomes "
            "worse when it is lower or higher. \"Noise\" as a unit is its root mean square, \"noise squared\" the "
            "square of it, \"chance\" a probability. A number that was chosen by eye and not by a measurement or a "
            "derivation says \"a guess\". The last column is what a fifth is taken of, to see how much depends on "
            "these numbers ([PROOF](PROOF.md)).\n",
            count);
    for (size_t i = 0; i < threshold_row_count; i++) {
        const threshold_row_t *row = &threshold_rows[i];
        if (row->topic != NULL) {
            fprintf(out, "\n## %s\n\n| name | value | unit | why | lower | higher | a fifth of |\n|---|--:|---|---|---|---|---|\n",
                    row->topic);
        } else {
            fprintf(out, "| `%s` | %.4g | %s | %s | %s | %s | %s |\n", row->name, row->value, row->unit, row->why,
                    row->lower, row->higher, moved_text(row->moved));
        }
    }
}

void manual_stages(FILE *out) {
    fputs("| stage | what it does | read |\n|---|---|---|\n", out);
    for (size_t i = 0; i < diagnosis_stage_count; i++) {
        const stage_t *stage = &diagnosis_stages[i];
        fprintf(out, "| %s | %s | `%s` |\n", stage->name, stage->does, stage->face);
    }
}
