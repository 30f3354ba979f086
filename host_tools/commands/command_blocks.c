/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "base/json_output.h"
#include "chain/catalogue.h"
#include "commands/command.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int run(int argc, char **argv);

const command_t command_blocks = {.name = "blocks",
                                  .order = 50,
                                  .arguments = "[--json]",
                                  .summary = "List the blocks that a model's chain can be made of",
                                  .details = "Names, parameters, units and ranges are those of the model file; the "
                                             "order is that of the signal. For each block\n"
                                             "that `hyst diagnose` looks for, it says how the block shows, which "
                                             "others it is hard to distinguish from, and what\n"
                                             "to record to identify it. Blocks that begin with empirical_ are no "
                                             "physical effects: they describe what\n"
                                             "no other block explains.",
                                  .run = run,
                                  .files = NULL,
                                  .examples = "# The catalogue for people, and for programs\n"
                                              "hyst blocks\n"
                                              "hyst blocks --json\n"};

static void print_block(const block_t *block) {
    printf("%s (%s)\n  %s\n", block->name, place_name(block->place), block->text);
    for (size_t p = 0; p < block->parameters; p++) {
        const parameter_info_t *info = &block->parameter[p];
        printf("    %-18s %-5s %g .. %g%s", info->name, info->unit, info->low, info->high,
               info->array ? ", a list" : "");
        if (info->optional && !info->array && isfinite(info->default_value)) {
            printf(", default %g", info->default_value);
        } else if (info->optional) {
            printf(", optional");
        } else if (info->center_of != NULL || info->half_of != NULL) {
            printf(", default %s", info->center_of != NULL ? "the middle of the model's " : "half the model's ");
            printf("%s", info->center_of != NULL ? info->center_of : info->half_of);
        }
        printf("\n      %s\n", info->text);
    }
}

/* The other blocks in the group of a block that diagnose searches for. Returns their number. */
static size_t rest_of_group(const block_t *block, const block_t **others) {
    size_t count = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *other = catalogue[i];
        if (other != block && other->probe != NULL && block_same_group(other, block)) {
            others[count++] = other;
        }
    }
    return count;
}

static void print_probe(const block_t *block) {
    const block_t **others = allocate(catalogue_count, sizeof(const block_t *));
    const size_t count = rest_of_group(block, others);
    printf("  looks like: %s\n  confused with: %s", block->probe->explanation, count == 0 ? "none" : "");
    for (size_t i = 0; i < count; i++) {
        printf("%s%s", i > 0 ? ", " : "", others[i]->name);
    }
    printf("%s%s%s\n  revealed by: %s\n", count > 0 ? " (group " : "", count > 0 ? block->probe->group : "",
           count > 0 ? ")" : "", block->probe->excitation);
    if (!probe_is_first(block->probe)) {
        printf("  looked for: where others of its group, or all blocks, leave more than noise\n");
    }
    free(others);
}

static json_t *rest_of_group_json(const block_t *block) {
    const block_t **others = allocate(catalogue_count, sizeof(const block_t *));
    const size_t count = rest_of_group(block, others);
    json_t *names = json_array();
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(names, json_string(others[i]->name));
    }
    free(others);
    return names;
}

/* The groups whose findings it may take the place of, or null. */
static json_t *in_place_of_json(const probe_t *probe) {
    const size_t most = sizeof probe->in_place_of / sizeof probe->in_place_of[0];
    json_t *groups = probe->in_place_of[0] != NULL ? json_array() : json_null();
    for (size_t i = 0; i < most && probe->in_place_of[i] != NULL; i++) {
        json_array_append_new(groups, json_string(probe->in_place_of[i]));
    }
    return groups;
}

/* All null for a block that diagnose does not search for. */
static json_t *probe_json(const block_t *block) {
    static const probe_t none = {0};
    const probe_t *probe = block->probe != NULL ? block->probe : &none;
    return json_pack("{s:s?, s:s?, s:o, s:s?, s:o}", "group", probe->group, "looks_like", probe->explanation,
                     "confused_with", block->probe != NULL ? rest_of_group_json(block) : json_null(), "revealed_by",
                     probe->excitation, "in_place_of", in_place_of_json(probe));
}

static json_t *block_json(const block_t *block) {
    json_t *parameters = json_array();
    for (size_t p = 0; p < block->parameters; p++) {
        const parameter_info_t *info = &block->parameter[p];
        json_t *entry = json_pack("{s:s, s:s, s:o, s:o, s:b, s:b, s:s}", "name", info->name, "unit", info->unit, "low",
                                  json_real(info->low), "high", json_real(info->high), "list", (int)info->array,
                                  "optional", (int)info->optional, "text", info->text);
        if (info->optional && !info->array) {
            json_object_set_new(entry, "default", json_number_or_null(info->default_value));
        }
        if (info->center_of != NULL) {
            json_object_set_new(entry, "default_center_of", json_string(info->center_of));
        }
        if (info->half_of != NULL) {
            json_object_set_new(entry, "default_half_of", json_string(info->half_of));
        }
        json_array_append_new(parameters, entry);
    }
    json_t *json = json_pack("{s:s, s:s, s:s, s:o}", "block", block->name, "place", place_name(block->place), "text",
                             block->text, "parameters", parameters);
    json_object_update_new(json, probe_json(block));
    json_object_set_new(json, "empirical", json_boolean(block->empirical != NULL));
    return json;
}

static json_t *catalogue_json(void) {
    json_t *blocks = json_array();
    for (size_t i = 0; i < catalogue_count; i++) {
        json_array_append_new(blocks, block_json(catalogue[i]));
    }
    return json_pack("{s:s, s:o}", "format", "hyst-blocks-1", "blocks", blocks);
}

static int run(int argc, char **argv) {
    bool as_json = false;
    const option_t options[] = {JSON_OPTION(&as_json)};
    size_t positionals;
    failure_t failure;
    const int status = options_parse(&command_blocks, options, 1, argc, argv, 0, 0, &positionals);
    if (status != OPTIONS_RUN) {
        return status;
    }
    if (as_json && !json_print(catalogue_json(), JSON_INDENT(1), &failure)) {
        return failure_print(&failure);
    }
    for (size_t i = 0; text_wanted(as_json) && i < catalogue_count; i++) {
        print_block(catalogue[i]);
        if (catalogue[i]->probe != NULL) {
            print_probe(catalogue[i]);
        } else if (catalogue[i]->empirical != NULL) {
            printf("  no name: hyst diagnose fits it where no known effect explains the recordings\n");
        }
    }
    return STATUS_DONE;
}
