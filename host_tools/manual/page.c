/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Manual pages in the macros of man(7). */
#include "manual/manual.h"
#include <ctype.h>
#include <string.h>

/* Width from which a line of the source is broken at the next space outside `code`. */
enum { FULL_LINE = 54 };

/* Text of running lines: `code` becomes bold, and nothing in it is taken for a request. */
static void put_text(FILE *out, const char *text, size_t length) {
    bool code = false;
    size_t begin = 0;
    for (size_t i = 0; i < length; i++) {
        const char c = text[i];
        if (c == ' ' && !code && i - begin >= FULL_LINE) {
            fputc('\n', out);
            begin = i + 1;
        } else if (c == '`') {
            code = !code;
            fputs(code ? "\\fB" : "\\fR", out);
        } else if (c == '\\') {
            fputs("\\e", out);
        } else if (c == '-') {
            fputs("\\-", out);
        } else if (i == begin && (c == '.' || c == '\'')) {
            fprintf(out, "\\&%c", c);
        } else {
            fputc(c, out);
        }
    }
}

static void put_line(FILE *out, const char *text, size_t length) {
    put_text(out, text, length);
    fputc('\n', out);
}

/* Calls `put` for each line of text. */
static void each_line(FILE *out, const char *text, void (*put)(FILE *, const char *, size_t)) {
    while (text != NULL && *text != '\0') {
        const size_t length = strcspn(text, "\n");
        put(out, text, length);
        text += length + (text[length] == '\n' ? 1 : 0);
    }
}

/* What the line before was, where that decides whether a paragraph begins. */
static struct { bool entry, example; } before;

/* "  key   text": an entry of a list; any other line is running text. */
static void put_detail(FILE *out, const char *line, size_t length) {
    if (length > 2 && line[0] == ' ' && line[1] == ' ') {
        const char *key = line + 2;
        const size_t width = strcspn(key, " ");
        const char *text = key + width + strspn(key + width, " ");
        fprintf(out, ".TP\n.B %.*s\n", (int)width, key);
        put_line(out, text, length - (size_t)(text - line));
        before.entry = true;
        return;
    }
    if (before.entry) {
        fputs(".PP\n", out);
        before.entry = false;
    }
    put_line(out, line, length);
}

/* "NAME: text" */
static void put_file(FILE *out, const char *line, size_t length) {
    const size_t name = strcspn(line, ":");
    const size_t skip = name + 1 + strspn(line + name + 1, " ");
    fprintf(out, ".TP\n.I %.*s\n", (int)name, line);
    put_line(out, line + skip, length - skip);
}

/* "# what for" or a command line */
static void put_example(FILE *out, const char *line, size_t length) {
    if (line[0] == '#') {
        fputs(before.example ? ".PP\n" : "", out);
        put_text(out, line + 2, length - 2);
        fputs(":\n", out);
    } else {
        fputs(".PP\n.RS 4\n.EX\n", out);
        for (size_t i = 0; i < length; i++) { /* never broken */
            put_text(out, line + i, 1);
        }
        fputs("\n.EE\n.RE\n", out);
        before.example = true;
    }
}

/* Options bold, what stands for a value italic: "[-o MODEL.json] [options]" */
static void put_synopsis(FILE *out, const char *arguments) {
    const char *at = arguments;
    while (*at != '\0') {
        const bool option = *at == '-';
        const size_t length = strcspn(at, " ]|");
        const size_t body = option ? length : strspn(at, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz");
        if (body == 0) {
            put_text(out, at, 1);
            at++;
            continue;
        }
        fputs(option ? "\\fB" : "\\fI", out);
        put_text(out, at, body);
        fputs("\\fR", out);
        at += body;
    }
    fputc('\n', out);
}

/* The first line is the option's text; the others "name: text" are the values that it takes. */
static void put_option(FILE *out, const option_t *option) {
    fputs(".TP\n", out);
    if (option->letter != NULL) {
        fputs("\\fB", out);
        put_text(out, option->letter, strlen(option->letter));
        fputs("\\fR, ", out);
    }
    fputs("\\fB", out);
    put_text(out, option->name, strlen(option->name));
    fputs("\\fR", out);
    if (option->argument != NULL) {
        fputs(" \\fI", out);
        put_text(out, option->argument, strlen(option->argument));
        fputs("\\fR", out);
    } else if (option_optional(option->kind)[0] != '\0') { /* "[=FILE]": all but the frame is a name */
        const char *name = option_optional(option->kind) + strlen("[=");
        fprintf(out, "[=\\fI%.*s\\fR]", (int)strcspn(name, "]"), name);
    }
    fputc('\n', out);
    const char *text = option->help;
    size_t length = strcspn(text, "\n");
    put_line(out, text, length);
    if (text[length] == '\0') {
        return;
    }
    fputs(".RS\n", out);
    while (text[length] == '\n') {
        text += length + 1;
        text += strspn(text, " ");
        length = strcspn(text, "\n");
        put_file(out, text, length);
    }
    fputs(".RE\n", out);
}

static void put_exit_status(FILE *out) {
    fputs(".SH EXIT STATUS\n", out);
    put_line(out, HYST_EXIT_STATUS, strlen(HYST_EXIT_STATUS));
}

static void put_files(FILE *out, const char *files) {
    static const char where[] =
        "The formats are in `docs/FORMATS.md` of the documentation that is installed with hyst.";
    fputs(".SH FILES\n", out);
    each_line(out, files, put_file);
    fputs(".PP\n", out);
    put_line(out, where, strlen(where));
}

static void put_head(FILE *out, const char *date, const char *name, const char *summary) {
    char title[80];
    size_t i = 0;
    for (; name[i] != '\0' && i + 1 < sizeof title; i++) {
        title[i] = (char)toupper((unsigned char)name[i]);
    }
    title[i] = '\0';
    fprintf(out,
            ".\\\" Made from the option tables by hyst_manual.\n.TH %s 1 %s \"hyst %s\" \"hyst manual\"\n.SH NAME\n",
            title, date, HYST_VERSION);
    put_text(out, name, strlen(name));
    fprintf(out, " \\- %c", tolower((unsigned char)summary[0]));
    put_line(out, summary + 1, strlen(summary + 1));
}

static bool mentions(const char *text, const char *name) {
    static const char program[] = "hyst ";
    const size_t length = strlen(name);
    if (text == NULL) {
        return false;
    }
    for (const char *at = strstr(text, program); at != NULL; at = strstr(at, program)) {
        at += strlen(program);
        if (strncmp(at, name, length) == 0 && !isalnum((unsigned char)at[length])) {
            return true;
        }
    }
    return false;
}

/* The whole, and the commands that the page speaks of. */
static void put_see_also(FILE *out, const command_t *command) {
    fputs(".SH SEE ALSO\n.BR hyst (1)", out);
    for (size_t i = 0; i < commands_count; i++) {
        const char *name = commands[i]->name;
        if (commands[i] != command && (mentions(command->details, name) || mentions(command->examples, name))) {
            fprintf(out, ",\n.BR hyst\\-%s (1)", name);
        }
    }
    fputc('\n', out);
}

void manual_page(FILE *out, const char *date, const command_t *command, const option_t *options, size_t count) {
    static const option_t help = {"--help", "-h", OPTION_FLAG, NULL, "a summary of this page", NULL};
    char name[80];
    snprintf(name, sizeof name, "hyst-%s", command->name);
    put_head(out, date, name, command->summary);
    fprintf(out, ".SH SYNOPSIS\n.B hyst %s\n", command->name);
    put_synopsis(out, command->arguments);
    fputs(".SH DESCRIPTION\n", out);
    fprintf(out, "%s.\n", command->summary);
    if (command->details[0] != '\0') {
        fputs(".PP\n", out);
    }
    before.entry = false;
    each_line(out, command->details, put_detail);
    fputs(".SH OPTIONS\n", out);
    for (size_t i = 0; i < count; i++) {
        put_option(out, &options[i]);
    }
    put_option(out, &help);
    put_exit_status(out);
    if (command->files != NULL) {
        put_files(out, command->files);
    }
    if (command->examples != NULL) {
        fputs(".SH EXAMPLES\n", out);
        before.example = false;
        each_line(out, command->examples, put_example);
    }
    put_see_also(out, command);
}

void manual_overview(FILE *out, const char *date) {
    put_head(out, date, "hyst", "Identify and linearise the hysteresis of a piezo actuator");
    fputs(".SH SYNOPSIS\n.B hyst\n\\fICOMMAND\\fR [\\fIargument\\fR ...]\n.br\n.B hyst help\n[\\fICOMMAND\\fR]\n.br\n"
          ".B hyst \\-\\-version\n.SH DESCRIPTION\n",
          out);
    put_line(out, HYST_PURPOSE, strlen(HYST_PURPOSE));
    fputs(".SH COMMANDS\nEach has a page of its own.\n", out);
    for (size_t i = 0; i < commands_count; i++) {
        fprintf(out, ".TP\n.BR hyst\\-%s (1)\n", commands[i]->name);
        put_line(out, commands[i]->summary, strlen(commands[i]->summary));
    }
    fputs(".SH OPTIONS\n.TP\n\\fB\\-h\\fR, \\fB\\-\\-help\\fR\nthe commands, one line each\n"
          ".TP\n\\fB\\-V\\fR, \\fB\\-\\-version\\fR\nthe version\n",
          out);
    put_exit_status(out);
    fputs(".SH ENVIRONMENT\n", out);
    each_line(out, HYST_ENVIRONMENT, put_file);
    put_files(out, FILE_RECORDING FILE_MODEL FILE_IMAGE);
    fputs(".SH EXAMPLES\n", out);
    before.example = false;
    each_line(out,
              "# From a recording to a compensated amplifier\n"
              "hyst fit recording.csv -o model.json\n"
              "hyst compile model.json --sample-rate 10000 -o model.image\n"
              "hyst push model.image --port /dev/ttyUSB0\n"
              "hyst track --port /dev/ttyUSB0 --waveform sine --frequency 10 --both\n"
              "# What the model leaves out\n"
              "hyst record --port /dev/ttyUSB0 --probe all -o probe.csv\n"
              "hyst diagnose probe.csv --model model.json --report diagnosis.html -o better.json\n",
              put_example);
    fputs(".SH SEE ALSO\n", out);
    for (size_t i = 0; i < commands_count; i++) {
        fprintf(out, ".BR hyst\\-%s (1)%s\n", commands[i]->name, i + 1 < commands_count ? "," : "");
    }
}
