/* SPDX-License-Identifier: MIT */
/**
 * Conformance: the same integers come out of lib/hyst whatever compiles it and wherever it runs.
 *
 * Each subject drives a part of the library with numbers from a fixed generator, extremes included, and digests every
 * output. The program prints one line a subject: its name and the digest. Integer arithmetic only, no libc but memcpy:
 * it runs natively, as 32 bits and on the emulated Cortex-M4, and all must print expected.txt.
 *
 * A digest says that something differs, not what is right: that is the job of the tests in tests/unit.
 */
#ifndef CONFORMANCE_H
#define CONFORMANCE_H

#include "hyst/compensator.h"
#include "hyst/parameters.h"
#include <stdint.h>

/** 64-bit FNV-1a over the bytes of 32-bit words, least significant first on every machine. */
typedef struct {
    uint64_t value;
} digest_t;

void digest_add(digest_t *digest, uint32_t word);
void digest_add_signed(digest_t *digest, int32_t value);
void digest_add_wide(digest_t *digest, int64_t value);

/** xorshift64*, seeded by the subject's number. */
typedef struct {
    uint64_t state;
} generator_t;

uint32_t generate(generator_t *generator);
int32_t generate_signed(generator_t *generator);
/** 0 to count - 1. */
uint32_t generate_below(generator_t *generator, uint32_t count);
/** The same halved 0 to halvings - 1 times: small numbers are as likely as large ones. */
uint32_t generate_size(generator_t *generator, uint32_t count, uint32_t halvings);

/**
 * A signal that goes where trouble is: ramps with reversals, holds, steps of one unit, jumps of any size, and both ends
 * of the range.
 */
typedef struct {
    hyst_q31_t value;
    int32_t step;
    uint32_t samples_left;
} excitation_t;

/** The next sample. Starts at all zero. */
hyst_q31_t generate_signal(generator_t *generator, excitation_t *excitation);

/** The edges of a 32-bit number and what lies beside them. */
#define EXTREMES 14
extern const int32_t extremes[EXTREMES];

/** Arguments of a Prandtl-Ishlinskii model that hyst_pi_build accepts. Negative weights, close and far thresholds. */
void generate_hysteresis(generator_t *generator, hyst_parameters_t *parameters, uint32_t operators,
                         bool rate_dependent);

/** Family and table of a Preisach model that hyst_preisach_build accepts: each element between the bounds that its
 * neighbours leave, one in four on the lower one. */
void generate_preisach(generator_t *generator, hyst_parameters_t *parameters, uint32_t intervals);

/** Arguments of hyst_bouc_wen_build. */
typedef struct {
    uint32_t cells;
    hyst_q28_t direct;
    hyst_q31_t length[HYST_BOUC_WEN_MAX_CELLS];
    hyst_q28_t slope[HYST_BOUC_WEN_MAX_CELLS];
} bouc_wen_arguments_t;

/** Nearly all of them accepted: direct in [1/2, 1), slopes in (0, 1/2) of one sign, a branch that travels at most 1.5.
 */
void generate_bouc_wen(generator_t *generator, bouc_wen_arguments_t *arguments, uint32_t cells);

/**
 * direct in [1/4, 1/2), weights of both signs that leave every branch at least a quarter of it, feedback through a
 * twofold pole at 1/2 and one anywhere up to 3/4, so that g up to 1/32 cannot unsettle it.
 */
void generate_modified_play(generator_t *generator, hyst_modified_play_parameters_t *parameters, uint32_t divisions);

/** A stable section, sum of magnitudes below 15; one in four is close to the edge of stability. */
hyst_iir_section_t generate_section(generator_t *generator);

/** A whole valid parameter set. */
void generate_parameters(generator_t *generator, hyst_parameters_t *parameters);

/** Builds the compensator of a generated set. A refusal ends the program with status 1: the generator would be at
 * fault. */
void build(const hyst_parameters_t *parameters, hyst_compensator_t *compensator);

/** The subjects. Each prints nothing and needs no order. */
void subject_fixed(digest_t *digest, generator_t *generator);
void subject_play_and_stop(digest_t *digest, generator_t *generator);
void subject_pi_refusals(digest_t *digest, generator_t *generator);
void subject_pi(digest_t *digest, generator_t *generator, uint32_t operators, bool rate_dependent);
void subject_pi_carry(digest_t *digest, generator_t *generator);
void subject_preisach(digest_t *digest, generator_t *generator);
void subject_preisach_refusals(digest_t *digest, generator_t *generator);
void subject_iir(digest_t *digest, generator_t *generator);
void subject_iir_refusals(digest_t *digest, generator_t *generator);
void subject_image(digest_t *digest, generator_t *generator);
void subject_broken_images(digest_t *digest, generator_t *generator);
void subject_texts(digest_t *digest, generator_t *generator);
void subject_compensator(digest_t *digest, generator_t *generator);
void subject_compensator_families(digest_t *digest, generator_t *generator);
void subject_compensator_windows(digest_t *digest, generator_t *generator);
void subject_sine(digest_t *digest, generator_t *generator);
void subject_curve(digest_t *digest, generator_t *generator);
void subject_bouc_wen(digest_t *digest, generator_t *generator);
void subject_bouc_wen_refusals(digest_t *digest, generator_t *generator);
void subject_modified_play(digest_t *digest, generator_t *generator);
void subject_modified_play_refusals(digest_t *digest, generator_t *generator);

#endif
