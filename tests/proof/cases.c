/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "cases.h"
#include <stdlib.h>
#include <string.h>

static const double strengths[] = {0.3, 1.0, 3.0, 10.0};
enum { STRENGTHS = sizeof strengths / sizeof strengths[0] };

const char *case_kind_name(case_kind_t kind) {
    static const char *const name[CASE_KINDS] = {"null", "single", "rare", "several", "unknown", "untestable"};
    return name[kind];
}

typedef struct {
    case_t *item;
    size_t count, room;
    random_t random;
} list_t;

/* A case without an effect: the sources, white and coloured noise and, for most, the designed record. */
static case_t *add(list_t *list, case_kind_t kind, excitation_kind_t excitation, source_t source, double correlation) {
    if (list->count == list->room) {
        case_t *larger = proof_allocate(2 * list->room + 16, sizeof *larger);
        if (list->count > 0) {
            memcpy(larger, list->item, list->count * sizeof *larger);
        }
        free(list->item);
        list->item = larger;
        list->room = 2 * list->room + 16;
    }
    case_t *item = &list->item[list->count++];
    *item = (case_t){.kind = kind,
                     .actuator = actuator_draw(source, &list->random),
                     .excitation = excitation,
                     .sample_rate_hz = excitation == EXCITATION_SHORT ? 5000.0 : 2000.0,
                     .recordings = 1,
                     .seed = random_bits(&list->random)};
    item->actuator.noise_correlation = correlation;
    return item;
}

static void hide(list_t *list, case_t *item, const effect_t *effect, double strength) {
    item->effect[item->effects++] =
        (presence_t){.effect = effect, .strength = strength, .seed = random_bits(&list->random)};
    if (strcmp(effect->name, "preload") == 0 && item->kind != CASE_UNTESTABLE) { /* one recording cannot show it */
        item->recordings = CASE_RECORDINGS;
        item->excitation = EXCITATION_SHORT;
        for (size_t i = 0; i < CASE_RECORDINGS; i++) {
            item->preload_n[i] = 5.0 * (double)i;
        }
    }
}

static double coloured(size_t i) {
    static const double correlation[] = {0.0, 0.9, 0.0, 0.5, 0.0, 0.99};
    return correlation[i % 6];
}

static source_t source_for(const effect_t *effect, size_t i) {
    const source_t source = (source_t)(i % SOURCE_COUNT);
    return effect->not_in_bouc_wen && source == SOURCE_BOUC_WEN ? SOURCE_PLANE : source;
}

static void add_nulls(list_t *list, size_t count) {
    for (size_t i = 0; i < count; i++) {
        static const excitation_kind_t excitation[] = {EXCITATION_DESIGNED, EXCITATION_DESIGNED, EXCITATION_SINES,
                                                       EXCITATION_SHORT,    EXCITATION_DESIGNED, EXCITATION_MULTISINE,
                                                       EXCITATION_SINE};
        add(list, CASE_NULL, excitation[i % 7], (source_t)(i % SOURCE_COUNT), coloured(i / SOURCE_COUNT));
    }
}

/* Every block at every strength: in the designed record with white noise, then in other records and with noise of all
 * colours. */
static void add_singles(list_t *list) {
    static const excitation_kind_t other[] = {EXCITATION_SINES, EXCITATION_DESIGNED, EXCITATION_MULTISINE,
                                              EXCITATION_DESIGNED};
    for (size_t e = 0; e < catalogue_effect_count; e++) {
        for (size_t s = 0; s < STRENGTHS; s++) {
            const effect_t *effect = &catalogue_effects[e];
            case_t *item = add(list, CASE_SINGLE, EXCITATION_DESIGNED, source_for(effect, e + s), 0.0);
            hide(list, item, effect, strengths[s]);
            item = add(list, CASE_SINGLE, other[(e + s) % 4], source_for(effect, e + s + 1), coloured(e + s + 1));
            hide(list, item, effect, strengths[s]);
        }
    }
}

static void add_rare(list_t *list) {
    static const char *const name[] = {"amplifier_slew_limit", "amplifier_saturation"};
    for (size_t i = 0; i < 6; i++) { /* the designed record holds its top, so saturation goes with the multisine */
        case_t *item = add(list, CASE_RARE, i % 2 == 0 ? EXCITATION_DESIGNED : EXCITATION_MULTISINE,
                           (source_t)(i % SOURCE_COUNT), 0.0);
        hide(list, item, effect_find(name[i % 2]), strengths[1 + i / 2 % 3]);
    }
}

static void add_several(list_t *list, size_t count) {
    static const struct {
        const char *name[CASE_EFFECTS];
        double strength[CASE_EFFECTS];
    } together[] = {
        {{"creep", "transport_delay"}, {10.0, 2.0}},
        {{"resonance", "creep"}, {10.0, 2.0}},
        {{"amplifier_bandwidth", "mains_interference"}, {8.0, 2.0}},
        {{"thermal_drift", "resonance"}, {10.0, 2.0}},
        {{"mains_interference", "creep"}, {10.0, 2.0}},
        {{"creep", "thermal_drift"}, {10.0, 3.0}},
        {{"static_nonlinearity", "creep"}, {10.0, 3.0}},
        {{"transport_delay", "resonance"}, {6.0, 3.0}},
        {{"gain_drift", "amplifier_bandwidth"}, {10.0, 2.0}},
        {{"amplifier_saturation", "mains_interference"}, {10.0, 2.0}},
        {{"amplifier_slew_limit", "creep"}, {10.0, 3.0}},
        {{"asymmetric_hysteresis", "transport_delay"}, {10.0, 2.0}},
        {{"charge_leakage", "mains_interference"}, {10.0, 2.0}},
        {{"creep", "amplifier_bandwidth"}, {3.0, 1.0}},
        {{"resonance", "mains_interference"}, {3.0, 1.0}},
        {{"creep", "sensor_bandwidth"}, {10.0, 4.0}},
        {{"creep", "resonance", "mains_interference"}, {10.0, 4.0, 2.0}},
        {{"thermal_drift", "transport_delay", "creep"}, {10.0, 4.0, 2.0}},
        {{"transport_delay", "creep", "mains_interference"}, {10.0, 4.0, 1.0}},
        {{"creep", "static_nonlinearity", "amplifier_bandwidth"}, {10.0, 4.0, 2.0}},
        {{"mains_interference", "gain_drift", "resonance"}, {10.0, 4.0, 2.0}},
        {{"resonance", "thermal_drift", "creep"}, {10.0, 3.0, 1.0}},
    };
    for (size_t i = 0; i < count && i < sizeof together / sizeof together[0]; i++) {
        case_t *item = add(list, CASE_SEVERAL, EXCITATION_DESIGNED, (source_t)(i % SOURCE_COUNT), coloured(i));
        for (size_t e = 0; e < CASE_EFFECTS && together[i].name[e] != NULL; e++) {
            hide(list, item, effect_find(together[i].name[e]), together[i].strength[e]);
        }
    }
}

static void add_unknown(list_t *list) {
    for (size_t e = 0; e < unknown_effect_count; e++) {
        for (size_t s = 2; s < STRENGTHS; s++) {
            case_t *item = add(list, CASE_UNKNOWN, EXCITATION_DESIGNED, (source_t)((e + s) % SOURCE_COUNT),
                               coloured(s == 2 ? 0 : e));
            hide(list, item, &unknown_effects[e], strengths[s]);
        }
    }
}

/* So small that a slow sine shows neither lags (15 us, 10 kHz) nor modes (1 kHz), and one preload shows no compliance.
 */
static void add_untestable(list_t *list) {
    static const struct {
        const char *name;
        double strength;
    } fast[] = {
        {"transport_delay", 0.05}, {"amplifier_bandwidth", 0.05}, {"sensor_bandwidth", 0.05}, {"resonance", 0.01}};
    for (size_t i = 0; i < 8; i++) {
        case_t *item = add(list, CASE_UNTESTABLE, EXCITATION_SINE, (source_t)(i % SOURCE_COUNT), coloured(i));
        hide(list, item, effect_find(fast[i % 4].name), fast[i % 4].strength);
    }
    for (size_t i = 0; i < 4; i++) {
        case_t *item = add(list, CASE_UNTESTABLE, EXCITATION_DESIGNED, (source_t)(i % SOURCE_COUNT), 0.0);
        hide(list, item, effect_find("preload"), 0.0);
        item->preload_n[0] = 8.0;
    }
}

static void add_reduced(list_t *list) {
    static const struct {
        const char *name;
        double strength;
    } single[] = {{"creep", 10.0},          {"resonance", 10.0},       {"mains_interference", 3.0},
                  {"transport_delay", 3.0}, {"thermal_drift", 10.0},   {"amplifier_saturation", 10.0},
                  {"gain_drift", 10.0},     {"sensor_bandwidth", 10.0}};
    add_nulls(list, 3);
    for (size_t i = 0; i < sizeof single / sizeof single[0]; i++) {
        case_t *item = add(list, CASE_SINGLE, EXCITATION_SHORT, (source_t)(i % SOURCE_COUNT), 0.0);
        hide(list, item, effect_find(single[i].name), single[i].strength);
    }
    add_several(list, 1);
    hide(list, add(list, CASE_UNTESTABLE, EXCITATION_SINE, SOURCE_PLAY, 0.0), effect_find("resonance"), 0.01);
    for (size_t e = 0; e < 3; e++) {
        hide(list, add(list, CASE_UNKNOWN, EXCITATION_SHORT, (source_t)e, 0.0), &unknown_effects[4 * e + 1], 10.0);
    }
    for (size_t i = 0; i < list->count; i++) {
        if (list->item[i].excitation == EXCITATION_DESIGNED) {
            list->item[i].excitation = EXCITATION_SHORT;
        }
        list->item[i].sample_rate_hz = 1000.0;
    }
}

case_t *cases_list(uint64_t seed, bool reduced, size_t *count) {
    list_t list = {.random = {seed}};
    if (reduced) {
        add_reduced(&list);
    } else {
        add_nulls(&list, 42);
        add_singles(&list);
        add_rare(&list);
        add_several(&list, SIZE_MAX);
        add_unknown(&list);
        add_untestable(&list);
    }
    for (size_t i = list.count; i > 1; i--) { /* shuffle */
        const size_t other = (size_t)(random_bits(&list.random) % i);
        const case_t kept = list.item[i - 1];
        list.item[i - 1] = list.item[other];
        list.item[other] = kept;
    }
    *count = list.count;
    return list.item;
}
