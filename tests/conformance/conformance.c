/* SPDX-License-Identifier: MIT */
#include "conformance.h"
#include "console.h"

static void print_line(const char *name, uint64_t value) {
    char digits[] = " 0000000000000000\n";
    for (unsigned i = 0; i < 16; i++) {
        digits[16U - i] = "0123456789abcdef"[value >> (4U * i) & 0xFU];
    }
    console_write(name);
    console_write(digits);
}

/* A fixed seed a subject: a new one leaves the digests of the others alone. */
static digest_t no_digest(void) {
    return (digest_t){.value = 0xCBF29CE484222325U};
}

static generator_t seeded(uint32_t number) {
    return (generator_t){.state = 0x9E3779B97F4A7C15U * (number + 1U)};
}

int main(void) {
    static const struct {
        const char *name;
        void (*run)(digest_t *, generator_t *);
    } subjects[] = {
        {"fixed", subject_fixed},
        {"play_and_stop", subject_play_and_stop},
        {"pi_refusals", subject_pi_refusals},
        {"pi_carry", subject_pi_carry},
        {"iir", subject_iir},
        {"iir_refusals", subject_iir_refusals},
        {"image", subject_image},
        {"broken_images", subject_broken_images},
        {"texts", subject_texts},
        {"compensator", subject_compensator},
        {"preisach", subject_preisach},
        {"preisach_refusals", subject_preisach_refusals},
        {"sine", subject_sine},
        {"curve", subject_curve},
        {"bouc_wen", subject_bouc_wen},
        {"bouc_wen_refusals", subject_bouc_wen_refusals},
        {"modified_play", subject_modified_play},
        {"modified_play_refusals", subject_modified_play_refusals},
        {"compensator_families", subject_compensator_families},
        {"compensator_windows", subject_compensator_windows},
    };
    static const struct {
        const char *name;
        uint32_t operators;
        bool rate_dependent;
    } models[] = {
        {"pi_0_operators", 0, false},       {"pi_1_operator", 1, false},      {"pi_10_operators", 10, false},
        {"pi_64_operators", 64, false},     {"pi_1_operator_rate", 1, true},  {"pi_10_operators_rate", 10, true},
        {"pi_64_operators_rate", 64, true}, {"pi_256_operators", 256, false}, {"pi_256_operators_rate", 256, true},
    };
    for (uint32_t i = 0; i < sizeof subjects / sizeof subjects[0]; i++) {
        digest_t digest = no_digest();
        generator_t generator = seeded(i);
        subjects[i].run(&digest, &generator);
        print_line(subjects[i].name, digest.value);
    }
    for (uint32_t i = 0; i < sizeof models / sizeof models[0]; i++) {
        digest_t digest = no_digest();
        generator_t generator = seeded(100U + i);
        subject_pi(&digest, &generator, models[i].operators, models[i].rate_dependent);
        print_line(models[i].name, digest.value);
    }
    console_exit(0);
}
