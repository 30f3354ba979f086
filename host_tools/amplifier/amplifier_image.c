/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "amplifier/amplifier_image.h"
#include "amplifier/device/arming.h"
#include "base/monotonic_clock.h"
#include "hyst/cost.h"
#include "store/parameter_store.h"
#include <inttypes.h>
#include <string.h>

#define REGISTERS_PER_WORD 2U

static bool read_words(device_t *device, uint32_t words[HYST_IMAGE_MAX_WORDS], size_t *count, failure_t *failure) {
    int64_t length = 0;
    if (!device_read(device, INDEX_active_words, &length, failure)) {
        return false;
    }
    if (length < HYST_IMAGE_MIN_WORDS || length > HYST_IMAGE_MAX_WORDS) {
        return fail(failure, "the amplifier reports an image of %" PRId64 " words, possible are %u to %u", length,
                    HYST_IMAGE_MIN_WORDS, (unsigned)HYST_IMAGE_MAX_WORDS);
    }
    *count = (size_t)length;
    uint16_t registers[REGISTERS_PER_WORD * HYST_IMAGE_MAX_WORDS];
    if (!device_read_block(device, ADDRESS_active, 0, REGISTERS_PER_WORD * *count, registers, failure)) {
        return false;
    }
    for (size_t i = 0; i < *count; i++) {
        words[i] = ((uint32_t)registers[2 * i] << 16) | registers[2 * i + 1];
    }
    return true;
}

bool amplifier_image_read(device_t *device, hyst_parameters_t *parameters, failure_t *failure) {
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    size_t count = 0;
    if (!read_words(device, words, &count, failure)) {
        return false;
    }
    const hyst_parameters_fault_t fault = hyst_parameters_decode(words, count, parameters);
    return fault.error == HYST_PARAMETERS_OK ||
           fail(failure, "the image in the amplifier cannot be read: %s %s", hyst_field_text(fault.field),
                hyst_parameters_error_text(fault.error));
}

bool amplifier_image_is_neutral(const hyst_parameters_t *parameters) {
    hyst_parameters_t neutral;
    hyst_parameters_default(&neutral);
    return parameters->model_id == neutral.model_id && parameters->drive_center_uv == neutral.drive_center_uv &&
           parameters->drive_half_range_uv == neutral.drive_half_range_uv &&
           parameters->position_center_pm == neutral.position_center_pm &&
           parameters->position_half_range_pm == neutral.position_half_range_pm;
}

bool amplifier_image_is_of(const hyst_parameters_t *parameters, uint32_t model_id, const char *name,
                           failure_t *failure) {
    if (amplifier_image_is_neutral(parameters)) {
        return fail(failure, "%s is not in force: the amplifier has no parameters", name);
    }
    return parameters->model_id == model_id ||
           fail(failure,
                "%s is not in force: it is model 0x%08" PRIX32 ", and the amplifier's image is of 0x%08" PRIX32, name,
                model_id, parameters->model_id);
}

/* What it costs and what it may cost, in cycles. */
static bool too_costly(device_t *device, failure_t *failure) {
    int64_t cost[REGISTER_COUNT];
    return device_read_span(device, INDEX_image_cost, INDEX_cost_budget, cost, failure) &&
           fail(failure,
                "the amplifier refuses the image and keeps the one it has: a sample takes up to %" PRId64
                " cycles of its processor (%u for an instruction are assumed), a period at %g Hz has %" PRId64
                ": compile it with fewer operators, sections or cells, or use a slower loop",
                cost[INDEX_image_cost], HYST_COST_CYCLES_PER_INSTRUCTION, device_sample_rate_hz(device),
                cost[INDEX_cost_budget]);
}

/* Turns the commit's result into a line. */
static bool check_commit(device_t *device, failure_t *failure) {
    int64_t fault[REGISTER_COUNT];
    if (!device_read_span(device, INDEX_fault_code, INDEX_fault_element, fault, failure)) {
        return false;
    }
    if (fault[INDEX_fault_code] == HYST_PARAMETERS_OK) {
        return true;
    }
    if (fault[INDEX_fault_code] == HYST_PARAMETERS_TOO_COSTLY) {
        return too_costly(device, failure);
    }
    return fail(failure, "the amplifier refuses the image and keeps the one it has: %s [%" PRId64 "] %s",
                hyst_field_text((hyst_field_t)fault[INDEX_fault_field]), fault[INDEX_fault_element],
                hyst_parameters_error_text((hyst_parameters_error_t)fault[INDEX_fault_code]));
}

static bool verify(device_t *device, const uint32_t *words, size_t count, failure_t *failure) {
    uint32_t active[HYST_IMAGE_MAX_WORDS];
    size_t active_count = 0;
    if (!read_words(device, active, &active_count, failure)) {
        return false;
    }
    if (active_count != count) {
        return fail(failure, "the image in force is not the one that was sent: %zu words instead of %zu", active_count,
                    count);
    }
    for (size_t i = 0; i < count; i++) {
        if (active[i] != words[i]) {
            return fail(failure,
                        "the image in force is not the one that was sent: word %zu is 0x%08" PRIX32
                        " instead of 0x%08" PRIX32,
                        i, active[i], words[i]);
        }
    }
    return true;
}

bool amplifier_image_write(device_t *device, const hyst_parameters_t *parameters, failure_t *failure) {
    const int64_t version = device_identity(device, INDEX_image_version);
    if (version != HYST_IMAGE_VERSION) {
        return fail(failure, "the amplifier takes images of version %" PRId64 ", this hyst writes %u: upgrade %s",
                    version, HYST_IMAGE_VERSION, version > HYST_IMAGE_VERSION ? "hyst" : "the amplifier's firmware");
    }
    const double image_rate_hz = (double)parameters->sample_rate_mhz / 1000.0;
    if (image_rate_hz != device_sample_rate_hz(device)) {
        return fail(
            failure,
            "the image is made for %g samples per second, the amplifier runs at %g: compile it with --sample-rate %g",
            image_rate_hz, device_sample_rate_hz(device), device_sample_rate_hz(device));
    }
    uint32_t words[HYST_IMAGE_MAX_WORDS];
    const size_t count = hyst_parameters_encode(parameters, words, HYST_IMAGE_MAX_WORDS);
    uint16_t registers[REGISTERS_PER_WORD * HYST_IMAGE_MAX_WORDS];
    for (size_t i = 0; i < count; i++) {
        registers[2 * i] = (uint16_t)(words[i] >> 16);
        registers[2 * i + 1] = (uint16_t)words[i];
    }
    if (!device_unlock(device, CONTROL_PARAMETERS, failure)) {
        return false;
    }
    if (!device_write_block(device, ADDRESS_staging, 0, REGISTERS_PER_WORD * count, registers, failure)) {
        return false;
    }
    const bool committed = device_command(device, COMMAND_COMMIT, failure);
    failure_t reason;
    if (!check_commit(device, &reason)) {
        *failure = reason;
        return false;
    }
    return committed && verify(device, words, count, failure);
}

/* A ramp over the whole range takes a board at most 10 s (hyst/board_limits.h). */
#define REST_S 12.0
#define POLL_S 0.1

bool amplifier_image_store(device_t *device, failure_t *failure) {
    if (!device_expect_off(device, "its image", failure) || !device_unlock(device, CONTROL_PARAMETERS, failure)) {
        return false;
    }
    const double until_s = monotonic_s() + REST_S;
    bool refused; /* not yet at rest, or for good */
    while (!device_save(device, &refused, failure)) {
        const failure_t why = *failure;
        if (!refused || !device_expect_off(device, "its image", failure)) {
            return false;
        }
        if (monotonic_s() > until_s) {
            *failure = why;
            return false;
        }
        sleep_until(monotonic_s() + POLL_S);
    }
    int64_t state = STORE_NONE;
    return device_read(device, INDEX_store_state, &state, failure) &&
           (state == STORE_SAVED ||
            fail(failure,
                 "the amplifier did not store its image (store_state %" PRId64 "): what was stored before still is",
                 state));
}
