/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/backup.h"
#include "amplifier/amplifier_image.h"
#include "compile/compile.h"
#include <inttypes.h>
#include <string.h>

static const char format_name[] = "hyst-backup-1";

/* A setting: what can be read and written and moves nothing by itself. The line belongs to the place, not to what the
 * amplifier does there: two amplifiers of one backup would have one address. The communication timeout belongs to the
 * master that is there; an amplifier never keeps it over a start, and a backup that had it would. */
static bool is_setting(int which) {
    const bool of_line = which == INDEX_line_address || which == INDEX_line_baud || which == INDEX_line_parity;
    return register_table[which].access == REGISTER_RW && which != INDEX_mode && which != INDEX_setpoint &&
           which != INDEX_stream_from && which != INDEX_watchdog && !of_line;
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

/* The limits that come in pairs, each by its lower one, which the upper one follows: the amplifier takes no lower limit
 * above the upper one, so both are written at once. */
static bool is_lower_limit(int which) {
    return which == INDEX_drive_low || which == INDEX_reference_low;
}

/* Whether the settings have it. */
static bool setting_of(const json_t *settings, int which, int64_t *value) {
    const json_t *found = json_object_get(settings, register_table[which].name);
    *value = json_integer_value(found);
    return found != NULL;
}

static bool has_limits(const json_t *settings, int lower, int64_t limit[2]) {
    return setting_of(settings, lower, &limit[0]) && setting_of(settings, lower + 1, &limit[1]);
}

/* least: how far apart they are at least. */
static bool check_limits(const json_t *settings, int lower, int64_t least, const char *where, failure_t *failure) {
    int64_t limit[2];
    return !has_limits(settings, lower, limit) || limit[1] - limit[0] >= least ||
           fail(failure, "%s: settings: %s is %" PRId64 ", not below %s, %" PRId64, where, register_table[lower].name,
                limit[0], register_table[lower + 1].name, limit[1]);
}

static bool settings_check(json_t *settings, const char *where, failure_t *failure) {
    const char *name;
    json_t *value;
    json_object_foreach(settings, name, value) {
        const int which = index_of(name);
        int64_t low, high;
        if (!json_is_integer(value)) {
            return fail(failure, "%s: settings: %s is not a whole number", where, name);
        }
        if (which == REGISTER_COUNT) {
            continue;
        }
        device_register_range(which, &low, &high);
        if (json_integer_value(value) < low || json_integer_value(value) > high) {
            return fail(failure,
                        "%s: settings: %s is %" JSON_INTEGER_FORMAT ", and the register takes %" PRId64 " to %" PRId64,
                        where, name, json_integer_value(value), low, high);
        }
    }
    return check_limits(settings, INDEX_drive_low, 1, where, failure) &&
           check_limits(settings, INDEX_reference_low, 0, where, failure);
}

/* The registers first..last, which the amplifier takes together. */
static bool span_write(device_t *device, const json_t *settings, int first, int last, backup_done_t *done,
                       failure_t *failure) {
    int64_t wanted[REGISTER_COUNT], now[REGISTER_COUNT];
    failure_t unknown;
    const size_t count = (size_t)last - (size_t)first + 1;
    if (!device_read_span(device, first, last, now, &unknown)) {
        done->not_there += count;
        return true;
    }
    for (int i = first; i <= last; i++) {
        (void)setting_of(settings, i, &wanted[i]);
    }
    if (!device_write_span(device, first, last, wanted, failure) ||
        !device_read_span(device, first, last, now, failure)) {
        return false;
    }
    for (int i = first; i <= last; i++) {
        if (now[i] != wanted[i]) {
            return fail(failure, "register %s is %" PRId64 " after writing %" PRId64, register_table[i].name, now[i],
                        wanted[i]);
        }
    }
    done->settings += count;
    return true;
}

static bool settings_write(device_t *device, json_t *settings, backup_done_t *done, failure_t *failure) {
    const char *name;
    json_t *value;
    json_object_foreach(settings, name, value) {
        const int which = index_of(name);
        int64_t limit[2];
        if (which == INDEX_watchdog) {
            done->watchdog = true;
            continue;
        }
        if (which == REGISTER_COUNT || !is_setting(which)) {
            done->not_there++;
            continue;
        }
        if (is_lower_limit(which - 1) && has_limits(settings, which - 1, limit)) {
            continue; /* with the lower one */
        }
        const bool both = is_lower_limit(which) && has_limits(settings, which, limit);
        if (!span_write(device, settings, which, both ? which + 1 : which, done, failure)) {
            return false;
        }
    }
    return true;
}

/* The amplifier takes no image whose drive_park is outside of drive_low to drive_high, and no such limits to an image.
 * Where the limits in force do not hold the backup's, they are widened until its own follow. */
static bool image_put(device_t *device, const hyst_parameters_t *image, const json_t *settings, failure_t *failure) {
    int64_t before[REGISTER_COUNT], wide[REGISTER_COUNT], limit[2];
    failure_t ignored;
    if (!has_limits(settings, INDEX_drive_low, limit) ||
        !device_read_span(device, INDEX_drive_low, INDEX_drive_high, before, &ignored) ||
        (image->drive_park >= before[INDEX_drive_low] && image->drive_park <= before[INDEX_drive_high])) {
        return amplifier_image_write(device, image, failure);
    }
    wide[INDEX_drive_low] = before[INDEX_drive_low] < limit[0] ? before[INDEX_drive_low] : limit[0];
    wide[INDEX_drive_high] = before[INDEX_drive_high] > limit[1] ? before[INDEX_drive_high] : limit[1];
    if (!device_unlock(device, CONTROL_PARAMETERS, failure) ||
        !device_write_span(device, INDEX_drive_low, INDEX_drive_high, wide, failure)) {
        return false;
    }
    const bool good = amplifier_image_write(device, image, failure);
    if (!good) {
        device_clean_up_begin(device);
        (void)device_write_span(device, INDEX_drive_low, INDEX_drive_high, before, &ignored);
        device_clean_up_end(device);
    }
    return good;
}

/* The image of the backup, or the one that stays in force, and the limits that come to it. */
static bool check_park(const hyst_parameters_t *image, const json_t *settings, const char *where, failure_t *failure) {
    int64_t limit[2];
    return !has_limits(settings, INDEX_drive_low, limit) ||
           (image->drive_park >= limit[0] && image->drive_park <= limit[1]) ||
           fail(failure,
                "%s: settings: drive_low %" PRId64 " to drive_high %" PRId64
                " do not hold drive_park of the image, %" PRId32,
                where, limit[0], limit[1], image->drive_park);
}

bool backup_write(device_t *device, const json_t *backup, const char *where, backup_done_t *done, failure_t *failure) {
    const char *format = json_string_value(json_object_get(backup, "format"));
    json_t *list = json_object_get(backup, "image");
    json_t *settings = json_object_get(backup, "settings");
    hyst_parameters_t image = {0};
    *done = (backup_done_t){.image = !json_is_null(list)};
    if (format == NULL || strcmp(format, format_name) != 0 || !json_is_object(settings)) {
        return fail(failure, "%s: not a backup of an amplifier (format %s)", where, format_name);
    }
    return (done->image ? image_from_json(list, where, &image, failure)
                        : amplifier_image_read(device, &image, failure)) &&
           settings_check(settings, where, failure) && check_park(&image, settings, where, failure) &&
           (!done->image || image_put(device, &image, settings, failure)) &&
           ((device_unlock(device, CONTROL_PARAMETERS | CONTROL_OUTPUT, failure) &&
             settings_write(device, settings, done, failure)) ||
            fail_in(failure, "%s: %s%zu settings of it are in force, and nothing is stored", where,
                    done->image ? "the image and " : "", done->settings));
}
