/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * hyst_manual FOLDER DATE: writes FOLDER/hyst.1, FOLDER/hyst-COMMAND.1, the completion of each shell, and tables for
 * the documents (THRESHOLDS.md, STAGES.md). Part of the build, not installed. Each command is run with --help, and what --help does is replaced: so a page has the options
 * that the command reads, and no list of them stands twice.
 */
#include "manual/manual.h"
#include "base/output_file.h"
#include <stdlib.h>

static const char *folder, *date;

static const completion_t *const completions[] = {&completion_bash, &completion_zsh, &completion_fish};
enum { SHELLS = sizeof completions / sizeof completions[0] };
static output_file_t completion_file[SHELLS];

static void open_file(output_file_t *file, const char *name) {
    char path[4096];
    failure_t failure;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (!output_file_open(file, path, &failure)) {
        exit(failure_print(&failure));
    }
}

static void close_file(output_file_t *file) {
    failure_t failure;
    if (!output_file_close(file, true, &failure)) {
        exit(failure_print(&failure));
    }
}

static void write_command(const command_t *command, const option_t *options, size_t count) {
    char name[80];
    output_file_t page;
    snprintf(name, sizeof name, "hyst-%s.1", command->name);
    open_file(&page, name);
    manual_page(page.file, date, command, options, count);
    close_file(&page);
    for (size_t i = 0; i < SHELLS; i++) {
        completions[i]->command(completion_file[i].file, command, options, count);
    }
}

static void write_table(const char *name, void (*table)(FILE *out)) {
    output_file_t page;
    open_file(&page, name);
    table(page.file);
    close_file(&page);
}

int main(int argc, char **argv) {
    char program[] = "hyst", ask[] = "--help";
    if (argc != 3) {
        fputs("usage: hyst_manual FOLDER DATE\n", stderr);
        return STATUS_USAGE;
    }
    folder = argv[1];
    date = argv[2];
    output_file_t page;
    open_file(&page, "hyst.1");
    manual_overview(page.file, date);
    close_file(&page);
    write_table("THRESHOLDS.md", manual_thresholds);
    write_table("STAGES.md", manual_stages);
    for (size_t i = 0; i < SHELLS; i++) {
        open_file(&completion_file[i], completions[i]->file);
        completions[i]->begin(completion_file[i].file);
    }
    options_set_help(write_command);
    for (size_t i = 0; i < commands_count; i++) {
        char *request[] = {program, ask, NULL};
        if (commands[i]->run(2, request) != STATUS_DONE) {
            fprintf(stderr, "hyst_manual: hyst %s --help failed\n", commands[i]->name);
            return STATUS_FAILED;
        }
    }
    for (size_t i = 0; i < SHELLS; i++) {
        completions[i]->end(completion_file[i].file);
        close_file(&completion_file[i]);
    }
    return STATUS_DONE;
}
