/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "recording/table/text_igor.h"
#include "recording/table/decimal.h"
#include "recording/table/units.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BLOCKS = 32 };

/* What stands before a sign, or before the end of a name, without blanks around it. Returns what comes behind it. */
static const char *take_word(const char *at, const char *ends, char *word, size_t room) {
    at += strspn(at, " ,");
    const size_t length = strcspn(at, ends);
    (void)snprintf(word, room, "%.*s", (int)length, at);
    return at + length + (at[length] == '"' ? 1 : 0);
}

/* SetScale/P x 0,0.001,"s", drive: `at` is behind the command's name. */
static void take_scale(table_t *table, const char *at, size_t line) {
    char unit[20], wave[40], origin[40];
    double first, step, scale;
    const bool per_point = strncmp(at, "/P", 2) == 0;
    at += per_point ? 2 : 0;
    at += strspn(at, " ");
    const char axis = *at;
    at += axis != '\0' ? 1 : 0;
    at += strspn(at, " ");
    if (!decimal_read(at, '.', &first, &at) || *at++ != ',' || !decimal_read(at, '.', &step, &at) ||
        strncmp(at, ",\"", 2) != 0) {
        return;
    }
    at = take_word(at + 2, "\"", unit, sizeof unit);
    (void)take_word(at, " ;,", wave, sizeof wave);
    const quantity_t quantity = unit_of(unit, &scale);
    if (axis == 'x' && per_point && step > 0.0 && quantity == QUANTITY_TIME) {
        (void)snprintf(origin, sizeof origin, "line %zu: SetScale", line);
        table_set_interval(table, scale * step, origin);
        table->start_s = scale * first;
    }
    for (size_t i = 0; (axis == 'y' || axis == 'd') && i < table->columns; i++) {
        if (strcmp(table->column[i].name, wave) == 0 && table->column[i].unit[0] == '\0') {
            free(table->column[i].unit);
            table->column[i].unit = copy_text(unit);
        }
    }
}

bool text_is_igor(const text_source_t *source) {
    return source->lines > 0 && strncmp(source->line[0], "IGOR", 4) == 0;
}

/* One of the blocks of waves: the line that names them, and the lines of numbers. */
typedef struct {
    const char *names;
    size_t begin, end;
} block_t;

/* From line *at on; false: there is none. */
static bool next_block(const text_source_t *source, size_t *at, block_t *block) {
    for (; *at + 1 < source->lines; ++*at) {
        const char *const line = source->line[*at];
        if (strncmp(line, "WAVES", 5) == 0 && strncmp(source->line[*at + 1], "BEGIN", 5) == 0) {
            block->names = line + strcspn(line, " \t");
            block->begin = *at + 2;
            for (*at = block->begin; *at < source->lines && strncmp(source->line[*at], "END", 3) != 0;) {
                ++*at;
            }
            block->end = *at;
            return true;
        }
    }
    return false;
}

/* Puts the lines of all blocks side by side in the place of the last one: the data may end with the file. */
static void put_side_by_side(text_source_t *source, const block_t *block, size_t blocks) {
    const block_t *const last = &block[blocks - 1];
    const size_t rows = last->end - last->begin;
    size_t room = strlen("WAVES") + 1, used = 0;
    for (size_t i = 0; i < blocks; i++) {
        room += strlen(block[i].names) + 1;
        for (size_t k = 0; k < rows; k++) {
            room += strlen(source->line[block[i].begin + k]) + 2;
        }
    }
    char *const text = allocate(room, 1);
    for (size_t k = 0; k <= rows; k++) {
        char *const line = text + used;
        used += (size_t)snprintf(line, room - used, "%s", k == 0 ? "WAVES" : "");
        for (size_t i = 0; i < blocks; i++) {
            const char *part = k == 0 ? block[i].names : source->line[block[i].begin + k - 1];
            part += strspn(part, " \t");
            used += (size_t)snprintf(text + used, room - used, "%s%s", k == 0 || i > 0 ? "\t" : "", part);
        }
        source->line[k == 0 ? last->begin - 2 : last->begin + k - 1] = line;
        used++;
    }
    source->joined = text;
}

bool text_join_igor_waves(text_source_t *source, const char *path, failure_t *failure) {
    block_t block[MOST_BLOCKS];
    size_t blocks = 0, at = 0;
    while (blocks < MOST_BLOCKS && next_block(source, &at, &block[blocks])) {
        const size_t rows = block[blocks].end - block[blocks].begin, others = block[0].end - block[0].begin;
        if (rows != others) {
            return fail(failure, "%s: line %zu: a wave of %zu points, others have %zu: export those of one length",
                        path, block[blocks].begin - 1, rows, others);
        }
        blocks++;
    }
    if (blocks < 2) {
        return true;
    }
    put_side_by_side(source, block, blocks);
    for (size_t i = 0; i + 1 < blocks; i++) {
        for (size_t k = block[i].begin - 2; k <= block[i].end && k < source->lines; k++) {
            source->line[k] = source->blank;
        }
    }
    return true;
}

void text_find_igor_scales(table_t *table, const char *const *line, size_t from, size_t lines) {
    static const char command[] = "SetScale";
    for (size_t i = from; i < lines; i++) {
        for (const char *at = line[i]; (at = strstr(at, command)) != NULL;) {
            at += strlen(command);
            take_scale(table, at, i + 1);
        }
    }
}
