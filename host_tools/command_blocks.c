/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "catalogue.h"
#include "command.h"
#include "json_output.h"
#include <math.h>
#include <stdio.h>

static int run(int argc, char **argv);

const command_t command_blocks = {
    .name = "blocks",
    .arguments = "[--json]",
    .summary = "List the blocks that a model's chain can be made of",
    .details = "Names, parameters, units and ranges are those of the model file; the order is that of the signal.",
    .run = run};

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
    return json_pack("{s:s, s:s, s:s, s:o}", "block", block->name, "place", place_name(block->place), "text",
                     block->text, "parameters", parameters);
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
    const option_t options[] = {{"--json", NULL, OPTION_FLAG, NULL, "print JSON", &as_json}};
    size_t positionals;
    failure_t failure;
    const int status = options_parse(&command_blocks, options, 1, argc, argv, 0, 0, &positionals);
    if (status != OPTIONS_RUN) {
        return status;
    }
    if (as_json) {
        return json_print(catalogue_json(), JSON_INDENT(1), &failure) ? STATUS_DONE : failure_print(&failure);
    }
    for (size_t i = 0; i < catalogue_count; i++) {
        print_block(catalogue[i]);
    }
    return STATUS_DONE;
}
