/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "identify/family.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define FAMILY_ADDRESS(name) &family_##name,
const family_t *const families[] = {FAMILY_LIST(FAMILY_ADDRESS)};
#undef FAMILY_ADDRESS
const size_t families_count = sizeof families / sizeof families[0];

void family_list_names(char *text, size_t room) {
    (void)snprintf(text, room, "all");
    for (size_t i = 0; i < families_count; i++) {
        const size_t used = strlen(text);
        (void)snprintf(text + used, room - used, ", %s", families[i]->name);
    }
}

const family_t *family_find(const char *name) {
    for (size_t i = 0; i < families_count; i++) {
        if (strcmp(families[i]->name, name) == 0) {
            return families[i];
        }
    }
    return NULL;
}

void family_note(family_notes_t *notes, const char *format, ...) {
    va_list arguments;
    if (notes->count < FAMILY_MAX_NOTES) {
        va_start(arguments, format);
        vsnprintf(notes->line[notes->count++], sizeof notes->line[0], format, arguments);
        va_end(arguments);
    }
}
