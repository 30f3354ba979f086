/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What an option's argument can be, from its row in the table. */
#include "chain/catalogue.h"
#include "manual/manual.h"
#include <ctype.h>
#include <string.h>

static void append(char words[VALUE_WORDS], const char *word, size_t length) {
    const size_t used = strlen(words);
    snprintf(words + used, VALUE_WORDS - used, "%s%.*s", used > 0 ? " " : "", (int)length, word);
}

/* Names of the blocks that `hyst record --probe` knows. */
static void append_blocks(char words[VALUE_WORDS]) {
    append(words, "all", 3);
    for (size_t i = 0; i < catalogue_count; i++) {
        if (catalogue[i]->probe != NULL) {
            append(words, catalogue[i]->name, strlen(catalogue[i]->name));
        }
    }
}

/* "name: text" lines under the option's help are its values. */
static void append_listed(char words[VALUE_WORDS], const char *help) {
    for (const char *line = strchr(help, '\n'); line != NULL; line = strchr(line, '\n')) {
        line += 1 + strspn(line + 1, " ");
        append(words, line, strcspn(line, ":"));
    }
}

/* "linear|compensate" names values; "N|auto" a number and one. */
static void append_alternatives(char words[VALUE_WORDS], const char *argument) {
    while (*argument != '\0') {
        const size_t length = strcspn(argument, "|");
        if (islower((unsigned char)argument[0])) {
            append(words, argument, length);
        }
        argument += length + (argument[length] == '|' ? 1 : 0);
    }
}

values_t option_values(const option_t *option, char words[VALUE_WORDS]) {
    words[0] = '\0';
    if (strchr(option->argument, '|') != NULL) {
        append_alternatives(words, option->argument);
    } else if (strchr(option->help, '\n') != NULL) {
        append_listed(words, option->help);
    } else if (strcmp(option->argument, "BLOCK") == 0) {
        append_blocks(words);
    } else if (strcmp(option->argument, "DEV") == 0) {
        return VALUES_PORT;
    } else if (option->kind != OPTION_NUMBER && option->kind != OPTION_NONZERO && option->kind != OPTION_COUNT &&
               option->kind != OPTION_RANGE && strcmp(option->argument, "TEXT") != 0 &&
               strchr(option->argument, ':') == NULL) {
        return VALUES_FILE;
    }
    return words[0] != '\0' ? VALUES_LISTED : VALUES_FREE;
}

bool takes_files(const command_t *command) {
    return isupper((unsigned char)command->arguments[0]) != 0; /* "MODEL ...", not "--port .." */
}
