/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * proof_generate --seed N [--reduced] FOLDER
 * proof_generate --effects
 *
 * Writes recordings into the folder, and on stdout what they hide, which nothing in the recordings says. The case's
 * number is that of its recordings: case-007.csv, or case-007-0.csv and so on where it has several.
 *
 * --effects lists what can be hidden of the catalogue of blocks, one a line: its name, then its parameters' names.
 */
#include "simulate.h"
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void write_recording(const char *folder, const case_t *item, size_t number, size_t recording,
                            const excitation_t *excitation, const double *reading) {
    char path[4096], part[16] = "";
    if (item->recordings > 1) {
        snprintf(part, sizeof part, "-%zu", recording);
    }
    snprintf(path, sizeof path, "%s/case-%03zu%s.csv", folder, number, part);
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        fprintf(stderr, "proof_generate: %s: %s\n", path, strerror(errno));
        exit(EXIT_FAILURE);
    }
    fprintf(file, "# sample_rate_hz: %.10g\n# drive_unit: V\n# displacement_unit: um\n", excitation->sample_rate_hz);
    fprintf(file, "# preload_n: %.10g\nt,drive,displacement\n", item->preload_n[recording]);
    for (size_t k = 0; k < excitation->samples; k++) {
        fprintf(file, "%.6f,%.6f,%.6f\n", (double)k / excitation->sample_rate_hz, excitation->drive_v[k * OVERSAMPLING],
                reading[k]);
    }
    if (ferror(file) != 0 || fclose(file) != 0) {
        fprintf(stderr, "proof_generate: %s: cannot be written\n", path);
        exit(EXIT_FAILURE);
    }
}

static void print_effect(const presence_t *presence, bool first) {
    const effect_t *effect = presence->effect;
    const char *separator = "";
    printf("%s\n      {\"name\": \"%s\", \"strength\": %.4g, \"visible\": %.4g, \"parameters\": {", first ? "" : ",",
           effect->name, presence->strength, presence->visible);
    for (size_t p = 0; p < EFFECT_PARAMETERS && effect->parameter[p] != NULL; p++) {
        printf("%s\"%s\": %.10g", separator, effect->parameter[p], presence->parameter[p]);
        separator = ", ";
    }
    printf("}}");
}

static void print_case(const case_t *item, size_t number, size_t samples, double noise_percent) {
    printf(
        "%s\n    {\"case\": \"case-%03zu\", \"kind\": \"%s\", \"source\": \"%s\", \"excitation\": \"%s\",\n"
        "     \"samples\": %zu, \"noise_um\": %.6g, \"noise_percent\": %.6g, \"noise_correlation\": %g, \"effects\": [",
        number > 0 ? "," : "", number, case_kind_name(item->kind), source_name(item->actuator.source),
        excitation_name(item->excitation), samples * item->recordings, item->actuator.noise_um, noise_percent,
        item->actuator.noise_correlation);
    for (size_t e = 0; e < item->effects; e++) {
        print_effect(&item->effect[e], e == 0);
    }
    printf("]}");
}

static void make(const char *folder, case_t *item, size_t number) {
    random_t random = {item->seed};
    excitation_t excitation =
        excitation_make(item->excitation, item->sample_rate_hz, item->actuator.low_v, item->actuator.high_v, &random);
    double least_range = HUGE_VAL;
    reach_strengths(item, &excitation);
    for (size_t r = 0; r < item->recordings; r++) {
        double *reading = simulate(item, r, &excitation), low = HUGE_VAL, high = -HUGE_VAL;
        for (size_t k = 0; k < excitation.samples; k++) {
            low = fmin(low, reading[k]);
            high = fmax(high, reading[k]);
        }
        least_range = fmin(least_range, high - low);
        write_recording(folder, item, number, r, &excitation, reading);
        free(reading);
    }
    print_case(item, number, excitation.samples, 100.0 * item->actuator.noise_um / least_range);
    excitation_free(&excitation);
}

static int list_effects(void) {
    for (size_t e = 0; e < catalogue_effect_count; e++) {
        printf("%s", catalogue_effects[e].name);
        for (size_t p = 0; p < EFFECT_PARAMETERS && catalogue_effects[e].parameter[p] != NULL; p++) {
            printf(" %s", catalogue_effects[e].parameter[p]);
        }
        printf("\n");
    }
    return EXIT_SUCCESS;
}

int main(int argc, char **argv) {
    if (argc == 2 && strcmp(argv[1], "--effects") == 0) {
        return list_effects();
    }
    uint64_t seed = 0;
    bool reduced = false, seeded = false;
    const char *folder = NULL;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--seed") == 0 && i + 1 < argc) {
            char *end;
            seed = strtoull(argv[++i], &end, 10);
            seeded = *argv[i] != '\0' && *end == '\0';
        } else if (strcmp(argv[i], "--reduced") == 0) {
            reduced = true;
        } else {
            folder = folder == NULL && argv[i][0] != '-' ? argv[i] : NULL;
        }
    }
    if (folder == NULL || !seeded) {
        fputs("usage: proof_generate --seed N [--reduced] FOLDER\n       proof_generate --effects\n", stderr);
        return 2;
    }
    size_t count;
    case_t *list = cases_list(seed, reduced, &count);
    printf("{\"format\": \"hyst-proof-answers-1\", \"seed\": %" PRIu64 ", \"cases\": [", seed);
    for (size_t i = 0; i < count; i++) {
        make(folder, &list[i], i);
    }
    printf("]}\n");
    free(list);
    return EXIT_SUCCESS;
}
