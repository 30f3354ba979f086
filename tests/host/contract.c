/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "contract.h"
#include "chain/catalogue.h"
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

typedef struct {
    const char *kind, *name;
    char *text;
    size_t count;
} complaints_t;

static void complain(complaints_t *to, const char *format, ...) {
    char line[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    const size_t length = strlen(to->text);
    snprintf(to->text + length, CONTRACT_TEXT - length, "%s %s: %s\n", to->kind, to->name, line);
    to->count++;
}

static bool empty(const char *text) {
    return text == NULL || text[0] == '\0';
}

static complaints_t begin(const char *kind, const char *name, char *text) {
    complaints_t to = {kind, empty(name) ? "?" : name, text, 0};
    if (empty(name)) {
        complain(&to, "no name");
    } else if (name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789_")] != '\0') {
        complain(&to, "its name is not of a-z, 0-9 and _");
    }
    return to;
}

static void check_parameter(complaints_t *to, const block_t *block, size_t p) {
    const parameter_info_t *info = &block->parameter[p];
    if (empty(info->name)) {
        complain(to, "parameter %zu: no name", p);
        return;
    }
    for (size_t q = 0; q < p; q++) {
        if (!empty(block->parameter[q].name) && strcmp(info->name, block->parameter[q].name) == 0) {
            complain(to, "parameter %s: twice", info->name);
        }
    }
    if (empty(info->text)) {
        complain(to, "parameter %s: no text", info->name);
    }
    if (empty(info->unit)) {
        complain(to, "parameter %s: no unit (\"1\" for none)", info->name);
    }
    if (!(info->low < info->high)) {
        complain(to, "parameter %s: no range, low < high", info->name);
    }
    if (info->optional && !info->array && isfinite(info->default_value) &&
        !(info->low <= info->default_value && info->default_value <= info->high)) {
        complain(to, "parameter %s: its default is outside of its range", info->name);
    }
    if (info->rising && !info->array) {
        complain(to, "parameter %s: rising, and no array", info->name);
    }
}

static bool has_parameter(const block_t *block, const char *name) {
    for (size_t p = 0; p < block->parameters; p++) {
        if (strcmp(block->parameter[p].name, name) == 0) {
            return true;
        }
    }
    return false;
}

/* The block of that name, with a complaint where there is none. */
static const block_t *named(complaints_t *to, const char *what, const char *name) {
    const block_t *other = catalogue_find(name);
    if (other == NULL) {
        complain(to, "%s: no block %s", what, name);
    }
    return other;
}

static void needs(complaints_t *to, const block_t *block, const char *trait, const char *const *names, size_t count) {
    for (size_t i = 0; i < count; i++) {
        if (!has_parameter(block, names[i])) {
            complain(to, "%s: no parameter %s", trait, names[i]);
        }
    }
}

static void check_traits(complaints_t *to, const block_t *block) {
    static const char *const plays[] = {"weights", "thresholds_v", "initial_memory_v"}, *const relays[] = {"levels_v",
                                                                                                           "everett_um",
                                                                                                           "past_v"};
    if (block->lag != LAG_NONE && block->parameters != 1) {
        complain(to, "lag: not one parameter");
    }
    if (block->twin != NULL) {
        const block_t *twin = named(to, "twin", block->twin);
        if (twin != NULL && (twin->twin == NULL || strcmp(twin->twin, block->name) != 0)) {
            complain(to, "twin: %s does not name it as its own", block->twin);
        }
        if (twin != NULL && (twin->lag != block->lag || twin->place == block->place)) {
            complain(to, "twin: %s is not the same lag at another place", block->twin);
        }
    }
    if (block->readings == READINGS_STEPPED && block->parameters == 0) {
        complain(to, "readings: no step");
    }
    if (block->operators == OPERATORS_PLAYS) {
        needs(to, block, "operators", plays, sizeof plays / sizeof plays[0]);
    } else if (block->operators == OPERATORS_RELAYS) {
        needs(to, block, "operators", relays, sizeof relays / sizeof relays[0]);
    }
}

/* What a block needs whose numbers are searched, as an effect or as an empirical term. */
static void check_search(complaints_t *to, const block_t *block) {
    const probe_t *probe = block_search(block);
    if (empty(probe->explanation)) {
        complain(to, "probe: no explanation");
    }
    if (empty(probe->excitation)) {
        complain(to, "probe: no excitation");
    }
    if (probe->probe == NULL) {
        complain(to, "probe: no instances");
    }
    if (((probe->searched | probe->positive) >> block->parameters) != 0) {
        complain(to, "probe: searches a parameter that the block has not");
    }
}

/* A term is no name, and must not pass for one. */
static void check_empirical(complaints_t *to, const block_t *block) {
    if (block->probe != NULL) {
        complain(to, "empirical: a probe, too, as if it were a physical effect");
    }
    if (strncmp(block->name, "empirical_", strlen("empirical_")) != 0) {
        complain(to, "empirical: its name does not begin with empirical_");
    }
    if (block->empirical->searched == 0) {
        complain(to, "empirical: nothing is searched");
    }
}

static void check_probe(complaints_t *to, const block_t *block) {
    const probe_t *probe = block->probe;
    if (empty(probe->group)) {
        complain(to, "probe: no group (a name of its own where nothing is confused with it)");
    }
    if (probe->parts == 0 || (probe->parts & ~(unsigned)PROBE_EVERYTHING) != 0) {
        complain(to, "probe: no parts of the excitation");
    }
    if (probe->in_place_of[0] == NULL && probe->in_place_of[1] != NULL) {
        complain(to, "probe: in_place_of begins with none");
    }
    for (size_t i = 0; i < 2 && probe->together[i] != NULL; i++) {
        (void)named(to, "probe: together", probe->together[i]);
    }
    if (probe->doubtful.beside != NULL) {
        const block_t *other = named(to, "probe: doubtful", probe->doubtful.beside);
        needs(to, block, "probe: doubtful", &probe->doubtful.size_um, 1);
        if (other != NULL && !has_parameter(other, probe->doubtful.part_of_range)) {
            complain(to, "probe: doubtful: no parameter %s of %s", probe->doubtful.part_of_range, other->name);
        }
    }
}

size_t contract_block(const block_t *block, char text[CONTRACT_TEXT]) {
    complaints_t to = begin("block", block->name, text);
    if (empty(block->text)) {
        complain(&to, "no text");
    }
    if (block->order == 0) {
        complain(&to, "no order");
    }
    if (block->parameters > BLOCK_MAX_PARAMETERS || (block->parameters > 0 && block->parameter == NULL)) {
        complain(&to, "no table of its parameters");
        return to.count;
    }
    for (size_t p = 0; p < block->parameters; p++) {
        check_parameter(&to, block, p);
    }
    if (block->open == NULL || block->settle == NULL || block->step == NULL) {
        complain(&to, "no simulation: open, settle and step");
    }
    if ((block->compile != NULL) == !empty(block->uncorrected)) {
        complain(&to, "either compile, or uncorrected, why there is none");
    }
    check_traits(&to, block);
    if (block_search(block) != NULL) {
        check_search(&to, block);
    }
    if (block->probe != NULL) {
        check_probe(&to, block);
    }
    if (block->empirical != NULL) {
        check_empirical(&to, block);
    }
    return to.count;
}

size_t contract_family(const family_t *family, char text[CONTRACT_TEXT]) {
    complaints_t to = begin("family", family->name, text);
    if (empty(family->text)) {
        complain(&to, "no text");
    }
    if (family->order == 0) {
        complain(&to, "no order");
    }
    if (family->fit == NULL) {
        complain(&to, "no fit");
    }
    return to.count;
}

size_t contract_command(const command_t *command, char text[CONTRACT_TEXT]) {
    complaints_t to = begin("command", command->name, text);
    if (command->order == 0) {
        complain(&to, "no order");
    }
    if (empty(command->arguments)) {
        complain(&to, "no arguments");
    }
    if (empty(command->summary)) {
        complain(&to, "no summary");
    }
    if (command->details == NULL) {
        complain(&to, "no details (\"\" for none)");
    }
    if (command->run == NULL) {
        complain(&to, "no run");
    }
    if (empty(command->examples)) {
        complain(&to, "no examples");
    }
    return to.count;
}

size_t contract_fault(const fault_kind_t *kind, char text[CONTRACT_TEXT]) {
    complaints_t to = begin("fault", kind->name, text);
    if (kind->order == 0) {
        complain(&to, "no order");
    }
    if (empty(kind->text)) {
        complain(&to, "no text");
    }
    if (empty(kind->statistic)) {
        complain(&to, "no statistic");
    }
    if (empty(kind->change)) {
        complain(&to, "no change: what to change in the set-up");
    }
    if (kind->find == NULL) {
        complain(&to, "no find");
    }
    return to.count;
}
