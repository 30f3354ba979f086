/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/backup.h"
#include "amplifier/amplifier_image.h"
#include "compile/compile.h"
#include <inttypes.h>
#include <string.h>

static const char format_name[] = "hyst-backup-1";

/* A setting: what can be read and written and moves nothing by itself. The line belongs to the place, not to what the
 * amplifier does there: two amplifiers of one backup would have one address. */
static bool is_setting(int which) {
    const bool of_line = which == INDEX_line_address || which == INDEX_line_baud || which == INDEX_line_parity;
    return register_table[which].access == REGISTER_RW && which != INDEX_mode && which != INDEX_setpoint &&
           which != INDEX_stream_from && !of_line;
}

static json_t *settings_read(device_t *device, failure_t *failure) {
    json_t *settings = json_object();
    for (int i = 0; i < REGISTER_COUNT; i++) {
        int64_t value = 0;
        if (!is_setting(i)) {
            continue;
        }
        if (!device_read(device, i, &value, failure)) {
            json_decref(settings);
            return NULL;
        }
        json_object_set_new(settings, register_table[i].name, json_integer((json_int_t)value));
    }
    return settings;
}

static json_t *image_to_json(const hyst_parameters_t *image) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    json_t *list = json_array();
    const size_t count = hyst_parameters_encode(image, words, HYST_IMAGE_MAX_WORDS);
    for (size_t i = 0; i < count; i++) {
        json_array_append_new(list, json_integer((json_int_t)words[i]));
    }
    return list;
}

json_t *backup_read(device_t *device, failure_t *failure) {
    hyst_parameters_t image;
    if (!amplifier_image_read(device, &image, failure)) {
        return NULL;
    }
    json_t *settings = settings_read(device, failure);
    if (settings == NULL) {
        return NULL;
    }
    return json_pack("{s:s, s:I, s:I, s:o, s:o}", "format", format_name, "board",
                     (json_int_t)device_identity(device, INDEX_board), "firmware_version",
                     (json_int_t)device_identity(device, INDEX_firmware_version), "image",
                     amplifier_image_is_neutral(&image) ? json_null() : image_to_json(&image), "settings", settings);
}

static bool image_from_json(const json_t *list, const char *where, hyst_parameters_t *image, failure_t *failure) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t count = json_array_size(list);
    if (!json_is_array(list) || count > HYST_IMAGE_MAX_WORDS) {
        return fail(failure, "%s: image: no list of at most %u words", where, (unsigned)HYST_IMAGE_MAX_WORDS);
    }
    for (size_t i = 0; i < count; i++) {
        const json_t *word = json_array_get(list, i);
        if (!json_is_integer(word) || json_integer_value(word) < 0 || json_integer_value(word) > UINT32_MAX) {
            return fail(failure, "%s: image: word %zu is not one of 32 bits", where, i);
        }
        words[i] = (uint32_t)json_integer_value(word);
    }
    const hyst_parameters_fault_t fault = hyst_parameters_decode(words, count, image);
    return (fault.error == HYST_PARAMETERS_OK || fail(failure, "%s: image: %s %s", where, hyst_field_text(fault.field),
                                                      hyst_parameters_error_text(fault.error))) &&
           parameters_check(image, where, failure);
}

static int index_of(const char *name) {
    const register_info_t *info = register_find(name);
    return info == NULL ? REGISTER_COUNT : (int)(info - register_table);
}

static bool settings_write(device_t *device, json_t *settings, const char *where, backup_done_t *done,
                           failure_t *failure) {
    const char *name;
    json_t *value;
    json_object_foreach(settings, name, value) {
        const int which = index_of(name);
        int64_t before = 0;
        int64_t after = 0;
        failure_t unknown;
        if (!json_is_integer(value)) {
            return fail(failure, "%s: settings: %s is not a whole number", where, name);
        }
        if (which == REGISTER_COUNT || !is_setting(which) || !device_read(device, which, &before, &unknown)) {
            done->not_there++;
            continue;
        }
        if (!device_write(device, which, json_integer_value(value), failure) ||
            !device_read(device, which, &after, failure)) {
            return false;
        }
        if (after != json_integer_value(value)) {
            return fail(failure, "register %s is %" PRId64 " after writing %" JSON_INTEGER_FORMAT, name, after,
                        json_integer_value(value));
        }
        done->settings++;
    }
    return true;
}

bool backup_write(device_t *device, const json_t *backup, const char *where, backup_done_t *done, failure_t *failure) {
    const char *format = json_string_value(json_object_get(backup, "format"));
    json_t *list = json_object_get(backup, "image");
    json_t *settings = json_object_get(backup, "settings");
    hyst_parameters_t image;
    *done = (backup_done_t){.image = !json_is_null(list)};
    if (format == NULL || strcmp(format, format_name) != 0 || !json_is_object(settings)) {
        return fail(failure, "%s: not a backup of an amplifier (format %s)", where, format_name);
    }
    return (!done->image ||
            (image_from_json(list, where, &image, failure) && amplifier_image_write(device, &image, failure))) &&
           device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, failure) &&
           settings_write(device, settings, where, done, failure);
}
