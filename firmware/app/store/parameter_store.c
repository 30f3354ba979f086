/* SPDX-License-Identifier: MIT */
#include "store/parameter_store.h"
#include "board.h"
#include "hyst/cost.h"
#include <string.h>

#define WORD_LENGTH 2U /* hyst/parameters.h: word 2 is the length */

static struct {
    uint32_t staging[PARAMETER_STORE_WORDS];
    uint32_t active[PARAMETER_STORE_WORDS];
    loop_parameters_t half[2];
    uint32_t checksum; /* of the other half */
    unsigned idle;     /* the half that the loop does not use */
    bool image_given;
    uint32_t active_cost; /* cycles */
    parameter_store_status_t status;
} store;

/* A checksum of so many bytes, which goes on from another one. */
static uint32_t checksum_on(uint32_t checksum, const void *bytes, size_t length) {
    const char *at = bytes;
    while (length > 0) {
        uint32_t words[16] = {checksum};
        const size_t portion = length < sizeof words - sizeof checksum ? length : sizeof words - sizeof checksum;
        memcpy(&words[1], at, portion);
        checksum = hyst_crc32(words, sizeof words / sizeof words[0]);
        at += portion;
        length -= portion;
    }
    return checksum;
}

/* Of what a build writes and nothing else does: not the limits in force, which are the registers' and the loop's. */
static uint32_t checksum_of(const loop_parameters_t *built) {
    const size_t before = offsetof(hyst_compensator_t, drive_low), from = offsetof(hyst_compensator_t, drive_park);
    uint32_t checksum = checksum_on(0, &built->compensator, before);
    checksum = checksum_on(checksum, (const char *)&built->compensator + from, sizeof built->compensator - from);
    checksum = checksum_on(checksum, &built->lookahead_samples, sizeof built->lookahead_samples);
    return checksum_on(checksum, &built->image_range, sizeof built->image_range);
}

bool parameter_store_whole(void) {
    return checksum_of(&store.half[1U - store.idle]) == store.checksum;
}

/* Notes what it costs, too. */
static hyst_parameters_fault_t check_cost(const hyst_parameters_t *parameters) {
    store.status.cost = hyst_cost_cycles(parameters);
    if (store.status.cost > store.status.cost_budget) {
        return (hyst_parameters_fault_t){.error = HYST_PARAMETERS_TOO_COSTLY, .field = HYST_FIELD_SAMPLE_RATE};
    }
    return (hyst_parameters_fault_t){.error = HYST_PARAMETERS_OK};
}

static hyst_parameters_fault_t build(const hyst_parameters_t *parameters, loop_parameters_t *half) {
    if (parameters->sample_rate_mhz != board_info.sample_rate_mhz) {
        return (hyst_parameters_fault_t){.error = HYST_PARAMETERS_INCONSISTENT, .field = HYST_FIELD_SAMPLE_RATE};
    }
    half->lookahead_samples = parameters->lookahead_samples;
    half->image_range = (drive_range_t){.low = parameters->drive_low,
                                        .high = parameters->drive_high,
                                        .park = parameters->drive_park,
                                        .return_slew = parameters->transition_slew};
    half->range = half->image_range;
    hyst_parameters_fault_t fault = hyst_parameters_build(parameters, &half->compensator);
    if (fault.error == HYST_PARAMETERS_OK) {
        fault = hyst_board_limits_check(&board_info.image_limits, &half->compensator);
    }
    if (fault.error == HYST_PARAMETERS_OK) {
        fault = check_cost(parameters);
    }
    return fault;
}

/* The stored image, into store.active and the first half. */
static bool load(hyst_parameters_t *parameters) {
    const size_t length = image_store_load(store.active, PARAMETER_STORE_WORDS);
    store.status.sequence = image_store_sequence();
    if (length == 0) {
        return false;
    }
    hyst_parameters_fault_t fault = hyst_parameters_decode(store.active, length, parameters);
    if (fault.error == HYST_PARAMETERS_OK) {
        fault = build(parameters, &store.half[0]);
    }
    store.status.fault = fault;
    store.image_given = fault.error == HYST_PARAMETERS_OK;
    store.status.stored = store.image_given ? STORE_LOADED : STORE_REFUSED;
    return store.image_given;
}

loop_parameters_t *parameter_store_init(void) {
    hyst_parameters_t parameters;
    memset(&store, 0, sizeof store);
    store.idle = 1;
    store.status.cost_budget = hyst_cost_budget(board_core_hz(), board_info.sample_rate_mhz);
    if (load(&parameters)) {
        store.active_cost = store.status.cost;
        store.checksum = checksum_of(&store.half[0]);
        return &store.half[0];
    }
    memset(store.active, 0, sizeof store.active);
    hyst_parameters_default(&parameters);
    parameters.sample_rate_mhz = board_info.sample_rate_mhz;
    parameters.drive_park = (hyst_q31_t)((uint32_t)(board_info.safe_code ^ BOARD_CODE_MIDDLE) << 16);
    (void)hyst_parameters_encode(&parameters, store.active, PARAMETER_STORE_WORDS);
    (void)build(&parameters, &store.half[0]); /* always valid; without it there is no loop, whatever it costs */
    store.active_cost = store.status.cost;
    store.checksum = checksum_of(&store.half[0]);
    return &store.half[0];
}

uint32_t *parameter_store_staging(void) {
    return store.staging;
}

const uint32_t *parameter_store_active(void) {
    return store.active;
}

bool parameter_store_has_time_for(uint32_t tones) {
    return store.active_cost + tones * HYST_COST_TONE * HYST_COST_CYCLES_PER_INSTRUCTION <= store.status.cost_budget;
}

bool parameter_store_image_given(void) {
    return store.image_given;
}

parameter_store_status_t parameter_store_status(void) {
    return store.status;
}

static bool note_saved(bool saved) {
    loop_set_storing(false);
    store.status.stored = saved ? STORE_SAVED : STORE_FAILED;
    store.status.sequence = image_store_sequence();
    return saved;
}

void parameter_store_save(const stored_limit_t *limits, size_t count) {
    loop_set_storing(true);
    (void)note_saved(image_store_save(store.active, store.active[WORD_LENGTH], limits, count));
}

size_t parameter_store_limits(stored_limit_t limits[IMAGE_STORE_LIMITS_MAX]) {
    return store.status.stored == STORE_LOADED ? image_store_limits(limits) : 0;
}

void parameter_store_refuse_limits(void) {
    store.status.stored = STORE_REFUSED;
    store.image_given = false;
}

bool parameter_store_save_line(const line_settings_t *line) {
    loop_set_storing(true);
    return note_saved(image_store_save_line(line));
}

line_settings_t parameter_store_line(bool forget) {
    const line_settings_t stored = image_store_line();
    return forget || !line_settings_valid(&stored) ? (line_settings_t)LINE_SETTINGS_DEFAULT : stored;
}

void parameter_store_commit(void) {
    hyst_parameters_t parameters;
    const uint32_t length = store.staging[WORD_LENGTH]; /* decode refuses more than HYST_IMAGE_MAX_WORDS unread */
    hyst_parameters_fault_t fault = hyst_parameters_decode(store.staging, length, &parameters);
    if (fault.error == HYST_PARAMETERS_OK) {
        fault = build(&parameters, &store.half[store.idle]);
    }
    if (fault.error == HYST_PARAMETERS_OK && !loop_limit_range(&store.half[store.idle])) {
        fault = (hyst_parameters_fault_t){.error = HYST_PARAMETERS_INCONSISTENT, .field = HYST_FIELD_DRIVE_PARK};
    }
    store.status.fault = fault;
    if (fault.error != HYST_PARAMETERS_OK) {
        return;
    }
    store.checksum = checksum_of(&store.half[store.idle]);
    (void)loop_adopt(&store.half[store.idle]);
    store.idle = 1U - store.idle;
    store.image_given = true;
    store.active_cost = store.status.cost;
    memset(store.active, 0, sizeof store.active);
    memcpy(store.active, store.staging, length * sizeof store.active[0]);
    if (store.status.commits < UINT16_MAX) {
        store.status.commits++;
    }
}
