/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "reproduction_page.h"
#include "base/json_output.h"
#include <errno.h>
#include <string.h>

/* More rows that are met are folded away, so that text and pictures can be found. */
static const size_t most_open = 12;

/* Text of a table's cell: a bar would end it. */
static void write_cell(FILE *file, const char *text) {
    for (; *text != '\0'; text++) {
        if (*text == '|') {
            fputc('\\', file);
        }
        fputc(*text, file);
    }
}

/* What the row asks for. */
static void write_demand(FILE *file, const reproduction_row_t *row) {
    switch (row->criterion) {
    case MET_AT_MOST:
        fprintf(file, "≤ %.6g", row->paper);
        break;
    case MET_AT_LEAST:
        fprintf(file, "≥ %.6g", row->paper);
        break;
    case MET_ABOVE:
        fprintf(file, "≥ %.6g, a bad result", row->paper);
        break;
    case MET_EQUAL:
        fprintf(file, "%.6g ± %.3g", row->paper, row->tolerance);
        break;
    }
}

static void write_rows(FILE *file, const reproduction_t *reproduction, bool met) {
    fprintf(file, "| quantity | paper | ours | unit | met |\n|---|---|---|---|---|\n");
    for (size_t i = 0; i < reproduction->rows; i++) {
        const reproduction_row_t *row = &reproduction->row[i];
        if (row->met != met) {
            continue;
        }
        fprintf(file, "| ");
        write_cell(file, row->quantity);
        fprintf(file, " | ");
        write_demand(file, row);
        fprintf(file, " | %.5g | ", row->ours);
        write_cell(file, row->unit);
        fprintf(file, " | %s |\n", met ? "yes" : "**no**");
    }
    fputc('\n', file);
}

static void write_section(FILE *file, const reproduction_t *reproduction) {
    const size_t met = reproduction_met(reproduction);
    fprintf(file, "<a id=\"%s\"></a>\n\n## %s: %s\n\n", reproduction->seed, reproduction->seed, reproduction->title);
    if (reproduction->failed) {
        fprintf(file, "**Failed**: %s\n\n", reproduction->failure.text);
    }
    if (met < reproduction->rows) {
        fprintf(file, "Not met:\n\n");
        write_rows(file, reproduction, false);
        for (size_t i = 0; i < reproduction->rows; i++) {
            const reproduction_row_t *row = &reproduction->row[i];
            if (!row->met && row->explanation != NULL) {
                fprintf(file, "* *%s*: %s\n", row->quantity, row->explanation);
            }
        }
        fputc('\n', file);
    }
    if (met > 0) {
        fprintf(file, "<details%s><summary>Met: %zu rows</summary>\n\n", met > most_open ? "" : " open", met);
        write_rows(file, reproduction, true);
        fprintf(file, "</details>\n\n");
    }
    if (reproduction->text != NULL) {
        fputs(reproduction->text, file);
    }
}

static void write_page(FILE *file, const reproduction_t *reproduction, size_t count) {
    fprintf(file,
            "# Reproduction of the papers\n\n"
            "Written by `scripts/reproduce`. What each paper reports stands beside what this project reaches on "
            "the same work. The actuators are twins: simulations written from what the papers report, which share "
            "no code and no formula with the models under test. Nothing here was measured on hardware. "
            "\"≤\", \"≥\" and \"±\" say how ours has to stand to the paper's number for the row to be met.\n\n");
    if (reproduction[0].reduced) {
        fprintf(file, "**Reduced length**: fewer frequencies and shorter recordings. Nothing is claimed here.\n\n");
    }
    fprintf(file, "| paper | | rows met | of |\n|---|---|---|---|\n");
    for (size_t i = 0; i < count; i++) {
        fprintf(file, "| [%s](#%s) | %s | %zu | %zu |\n", reproduction[i].seed, reproduction[i].seed,
                reproduction[i].title, reproduction_met(&reproduction[i]), reproduction[i].rows);
    }
    fputc('\n', file);
    for (size_t i = 0; i < count; i++) {
        write_section(file, &reproduction[i]);
    }
}

static bool write_json(FILE *file, const reproduction_t *reproduction, size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; i++) {
        for (size_t r = 0; r < reproduction[i].rows; r++) {
            const reproduction_row_t *row = &reproduction[i].row[r];
            json_array_append_new(list,
                                  json_pack("{s:s, s:s, s:o, s:o, s:s, s:b}", "seed", reproduction[i].seed, "quantity",
                                            row->quantity, "paper", json_number_or_null(row->paper), "ours",
                                            json_number_or_null(row->ours), "unit", row->unit, "met", row->met));
        }
    }
    const bool written =
        json_dumpf(list, file, JSON_INDENT(2) | JSON_REAL_PRECISION(12)) == 0 && fputc('\n', file) != EOF;
    json_decref(list);
    return written;
}

/* Opens OUTPUT/name. */
static FILE *open_output(const char *output, const char *name, failure_t *failure) {
    char path[4096];
    FILE *file = NULL;
    if (snprintf(path, sizeof path, "%s/%s", output, name) >= (int)sizeof path) {
        fail(failure, "%s: the path is too long", output);
    } else if ((file = fopen(path, "w")) == NULL) {
        fail(failure, "%s: %s", path, strerror(errno));
    }
    return file;
}

bool reproduction_write(const reproduction_t *reproduction, size_t count, const char *output, failure_t *failure) {
    FILE *json = open_output(output, "reproduction.json", failure);
    if (json == NULL) {
        return false;
    }
    const bool listed = write_json(json, reproduction, count);
    if (fclose(json) != 0 || !listed) {
        return fail(failure, "cannot write %s/reproduction.json", output);
    }
    FILE *page = open_output(output, "REPRODUCTION.md", failure);
    if (page == NULL) {
        return false;
    }
    write_page(page, reproduction, count);
    const bool failed = ferror(page) != 0;
    if (fclose(page) != 0 || failed) {
        return fail(failure, "cannot write %s/REPRODUCTION.md", output);
    }
    return true;
}
