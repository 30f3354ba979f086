/* SPDX-License-Identifier: MIT */
#include "store/parameter_store.h"
#include "board.h"
#include "hyst/cost.h"
#include <string.h>

#define WORD_LENGTH  2U /* hyst/parameters.h: word 2 is the length */
#define MHZ_TIMES_US 1000000000U

/* How far a checksum has come. */
typedef struct {
    unsigned part;
    size_t done;
    uint32_t checksum;
} walk_t;

static struct {
    uint32_t staging[PARAMETER_STORE_WORDS];
    uint32_t active[PARAMETER_STORE_WORDS];
    loop_parameters_t half[2];
    uint32_t checksum;    /* of the other half */
    walk_t walk;          /* through it, again and again */
    uint32_t walked;      /* loop_samples when its last portion was due */
    uint32_t check_every; /* samples */
    unsigned idle;        /* the half that the loop does not use */
    bool image_given;
    uint32_t active_cost; /* cycles */
    parameter_store_status_t status;
} store;

/* What a build writes and nothing else does: not the limits in force, which are the registers' and the loop's. */
enum { PARTS = 4 };
static const struct {
    size_t from, end;
} parts[PARTS] = {
    {offsetof(loop_parameters_t, compensator), offsetof(loop_parameters_t, compensator.drive_low)},
    {offsetof(loop_parameters_t, compensator.drive_park),
     offsetof(loop_parameters_t, compensator) + sizeof(hyst_compensator_t)},
    {offsetof(loop_parameters_t, lookahead_samples), offsetof(loop_parameters_t, lookahead_samples) + sizeof(uint32_t)},
    {offsetof(loop_parameters_t, image_range), offsetof(loop_parameters_t, image_range) + sizeof(drive_range_t)},
};

/* One portion more. False when there was none left. */
static bool walk_on(walk_t *walk, const loop_parameters_t *built) {
    uint32_t words[16] = {walk->checksum};
    const size_t most = sizeof words - sizeof words[0];
    if (walk->part == PARTS) {
        return false;
    }
    const size_t left = parts[walk->part].end - parts[walk->part].from - walk->done;
    const size_t portion = left < most ? left : most;
    memcpy(&words[1], (const char *)built + parts[walk->part].from + walk->done, portion);
    walk->checksum = hyst_crc32(words, sizeof words / sizeof words[0]);
    walk->done += portion;
    if (portion == left) {
        walk->part++;
        walk->done = 0;
    }
    return true;
}

static uint32_t checksum_of(const loop_parameters_t *built) {
    walk_t walk = {0};
    while (walk_on(&walk, built)) {
    }
    return walk.checksum;
}

bool parameter_store_whole(void) {
    return checksum_of(&store.half[1U - store.idle]) == store.checksum;
}

static void check_on(void) {
    if (!walk_on(&store.walk, &store.half[1U - store.idle])) {
        if (store.walk.checksum != store.checksum) {
            loop_image_damaged();
        }
        store.walk = (walk_t){0};
    }
}

void parameter_store_check(void) {
    const uint32_t now = loop_samples();
    const uint32_t most = PARAMETER_STORE_CHECK_BEHIND * store.check_every; /* two passes: no need for more */
    if (now - store.walked > most) {
        store.walked = now - most;
    }
    for (unsigned i = 0; i < PARAMETER_STORE_CHECK_MOST && now - store.walked >= store.check_every; i++) {
        store.walked += store.check_every;
        check_on();
    }
}

static uint32_t cost_of_tones(uint32_t tones) {
    return tones * HYST_COST_TONE * HYST_COST_CYCLES_PER_INSTRUCTION;
}

/* Notes what it costs, too. */
static hyst_parameters_fault_t check_cost(const hyst_parameters_t *parameters, uint32_t tones) {
    store.status.cost = hyst_cost_cycles(parameters);
    if (store.status.cost + cost_of_tones(tones) > store.status.cost_budget) {
        return (hyst_parameters_fault_t){.error = HYST_PARAMETERS_TOO_COSTLY, .field = HYST_FIELD_SAMPLE_RATE};
    }
    return (hyst_parameters_fault_t){.error = HYST_PARAMETERS_OK};
}

/* `tones`: that play while it is adopted. */
static hyst_parameters_fault_t build(const hyst_parameters_t *parameters, loop_parameters_t *half, uint32_t tones) {
    if (parameters->sample_rate_mhz != board_info.sample_rate_mhz) {
        return (hyst_parameters_fault_t){.error = HYST_PARAMETERS_INCONSISTENT, .field = HYST_FIELD_SAMPLE_RATE};
    }
    half->lookahead_samples = parameters->lookahead_samples;
    half->image_range = (drive_range_t){.low = parameters->drive_low,
                                        .high = parameters->drive_high,
                                        .park = parameters->drive_park,
                                        .return_slew = parameters->transition_slew,
                                        .slew = board_info.drive_slew_max};
    half->range = half->image_range;
    hyst_parameters_fault_t fault = hyst_parameters_build(parameters, &half->compensator);
    if (fault.error == HYST_PARAMETERS_OK) {
        fault = hyst_board_limits_check(&board_info.image_limits, &half->compensator);
    }
    if (fault.error == HYST_PARAMETERS_OK) {
        fault = check_cost(parameters, tones);
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
        fault = build(parameters, &store.half[0], 0);
    }
    store.status.fault = fault;
    store.image_given = fault.error == HYST_PARAMETERS_OK;
    store.status.stored = store.image_given ? STORE_LOADED : STORE_REFUSED;
    return store.image_given;
}

loop_parameters_t *parameter_store_init(uint32_t baud) {
    hyst_parameters_t parameters;
    memset(&store, 0, sizeof store);
    store.idle = 1;
    store.check_every = (uint32_t)((uint64_t)board_info.sample_rate_mhz * PARAMETER_STORE_CHECK_US / MHZ_TIMES_US);
    parameter_store_set_rate(baud);
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
    (void)build(&parameters, &store.half[0], 0); /* always valid; without it there is no loop, whatever it costs */
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

static uint32_t budget_at(uint32_t baud) {
    const uint32_t core_hz = board_core_hz();
    const uint32_t period = hyst_cost_budget(core_hz, board_info.sample_rate_mhz);
    const uint32_t byte = line_sample_budget(core_hz, baud);
    return byte < period ? byte : period;
}

void parameter_store_set_rate(uint32_t baud) {
    store.status.cost_budget = budget_at(baud);
}

bool parameter_store_leaves_time_for(uint32_t baud) {
    return !store.image_given || store.active_cost <= budget_at(baud);
}

bool parameter_store_has_time_for(uint32_t tones) {
    return store.active_cost + cost_of_tones(tones) <= store.status.cost_budget;
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
        fault = build(&parameters, &store.half[store.idle], loop_tones());
    }
    if (fault.error == HYST_PARAMETERS_OK && !loop_limit_range(&store.half[store.idle])) {
        fault = (hyst_parameters_fault_t){.error = HYST_PARAMETERS_INCONSISTENT, .field = HYST_FIELD_DRIVE_PARK};
    }
    store.status.fault = fault;
    if (fault.error != HYST_PARAMETERS_OK) {
        return;
    }
    store.checksum = checksum_of(&store.half[store.idle]);
    store.walk = (walk_t){0};
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
