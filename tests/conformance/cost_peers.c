/* SPDX-License-Identifier: MIT */
/*
 * The library's kernels beside what a user would write first, in one run on the emulated Cortex-M4: the inverse of a
 * play bank as a loop over the operators, in integers (tests/unit/plain.c) and in single precision on the FPU, and a
 * cascade of biquads in single precision. The same models and references for all of them.
 *
 * A line: "peer", kernel, size, worst and mean instructions, worst error, root mean square of the error (thousandths)
 * and of the signal, all three in units of 2^-31. The error of an inverse is that of the position which the exact
 * model takes at its drive, where the position can be reached; the error of a filter is that against double precision.
 */
#include "console.h"
#include "cost_case.h"
#include "plain.h"

enum { MODELS = 8, SAMPLES = 500, SECTIONS = 4 };

typedef struct {
    cost_t cost;
    int64_t worst;
    double error, signal;
} score_t;

static void score(score_t *s, uint32_t taken, int32_t wanted, double error) {
    cost_add(&s->cost, taken);
    const int64_t size = (int64_t)(error < 0.0 ? -error : error);
    s->worst = size > s->worst ? size : s->worst;
    s->error += error * error;
    s->signal += (double)wanted * wanted;
}

static uint32_t root(double x) {
    double guess = 1.0;
    for (int i = 0; i < 80; i++) { /* Newton's iteration from any positive number */
        guess = 0.5 * (guess + x / guess);
    }
    return (uint32_t)(guess + 0.5);
}

static void print(const char *kernel, uint32_t size, const score_t *s) {
    console_write("peer ");
    console_write(kernel);
    cost_print_number(size);
    cost_print(&s->cost);
    cost_print_number((uint32_t)s->worst);
    cost_print_number(root(1e6 * s->error / s->cost.calls));
    cost_print_number(root(s->signal / s->cost.calls));
    console_write("\n");
}

/* The loop over the operators in single precision, as in [004]: thresholds first, then each operator. */
static struct {
    uint32_t operators;
    float offset, weight[HYST_PI_MAX_OPERATORS + 1], threshold[HYST_PI_MAX_OPERATORS];
    float beta, rate_gain, limit;
    float memory[HYST_PI_MAX_OPERATORS], drive, rate;
} single;

static void single_set(const hyst_pi_t *model) {
    single.operators = model->operators;
    single.offset = (float)model->offset * 0x1p-31F;
    single.beta = (float)model->beta * 0x1p-20F;
    single.rate_gain = (float)model->rate_gain * 0x1p-30F;
    single.limit = (float)model->kappa_limit * 0x1p-31F;
    single.drive = single.rate = 0.0F;
    for (uint32_t i = 0; i <= model->operators; i++) {
        single.weight[i] = (float)(model->slope[i].value - (i > 0 ? model->slope[i - 1U].value : 0)) * 0x1p-28F;
    }
    for (uint32_t i = 0; i < model->operators; i++) {
        single.threshold[i] = (float)model->threshold[i] * 0x1p-31F;
        single.memory[i] = 0.0F;
    }
}

static float single_growth(void) {
    const float growth = single.beta * (single.rate < 0.0F ? -single.rate : single.rate);
    return growth < single.limit ? growth : single.limit;
}

static float single_solve(float position) {
    const float growth = single_growth();
    float rest = position - single.offset;
    for (uint32_t i = 0; i < single.operators; i++) {
        rest -= single.weight[i + 1U] * single.memory[i];
    }
    /* rest = w_0 u inside the gap; outwards, the corners one after the other. */
    float drive = rest / single.weight[0];
    float slope = single.weight[0];
    const float outward = single.operators > 0 && drive < single.memory[0] ? -1.0F : 1.0F;
    for (uint32_t i = 0; i < single.operators; i++) {
        const float corner = single.memory[i] + outward * (single.threshold[i] + growth);
        if (outward * (drive - corner) <= 0.0F) {
            break;
        }
        const float beyond = (drive - corner) * slope;
        slope += single.weight[i + 1U];
        drive = corner + beyond / slope;
    }
    return drive > 1.0F ? 1.0F : drive < -1.0F ? -1.0F : drive;
}

static void single_advance(float drive) {
    const float growth = single_growth();
    for (uint32_t i = 0; i < single.operators; i++) {
        const float r = single.threshold[i] + growth;
        const float low = drive - r;
        const float high = drive + r;
        const float z = single.memory[i];
        single.memory[i] = z < low ? low : z > high ? high : z;
    }
    single.rate += single.rate_gain * (drive - single.drive - single.rate);
    single.drive = drive;
}

static hyst_q31_t to_q31(float x) {
    return hyst_saturate((int64_t)(x * 0x1p31F));
}

/* Position error of a drive, by the exact model in the state it was found in. */
static double miss(const hyst_pi_t *model, const hyst_pi_state_t *before, hyst_q31_t drive, hyst_q31_t wanted) {
    static hyst_pi_state_t there;
    there = *before;
    return (double)hyst_pi_forward(model, &there, drive) - wanted;
}

static void compare_banks(generator_t *generator, uint32_t operators) {
    static hyst_parameters_t p;
    static hyst_pi_t model;
    static hyst_pi_state_t state, start;
    static plain_t plain;
    score_t ours = {.worst = 0};
    score_t loop = {.worst = 0};
    score_t fpu = {.worst = 0};
    for (unsigned m = 0; m < MODELS; m++) {
        uint32_t element;
        cost_reference_t reference = {.depth = 0};
        hyst_parameters_default(&p);
        generate_hysteresis(generator, &p, operators, true);
        cost_spread_thresholds(&p);
        if (hyst_pi_build(&model, operators, 0, p.pi_weight, p.pi_threshold, p.pi_beta, p.pi_rate_gain, &element) !=
            HYST_PI_OK) {
            console_write("cost_peers: a generated model is refused\n");
            console_exit(1);
        }
        hyst_pi_reset(&model, &state, 0);
        plain_reset(&model, &plain, 0);
        single_set(&model);
        for (unsigned k = 0; k < SAMPLES; k++) {
            const hyst_q31_t wanted = cost_reference(generator, &reference, COST_STAIRS, k) / 8;
            start = state;
            bool saturated = false;
            hyst_pi_found_t found;
            uint32_t before = cost_counter();
            const hyst_q31_t drive = hyst_pi_find(&model, &state, wanted, &found);
            hyst_pi_follow(&model, &state, drive, &found);
            const uint32_t ours_took = cost_counter() - before - cost_of_looking();
            before = cost_counter();
            const hyst_q31_t drive_again = plain_solve(&model, &plain, wanted, &saturated);
            plain_advance(&model, &plain, drive_again);
            const uint32_t loop_took = cost_counter() - before - cost_of_looking();
            const float wanted_single = (float)wanted * 0x1p-31F;
            before = cost_counter();
            const float drive_single = single_solve(wanted_single);
            single_advance(drive_single);
            const uint32_t fpu_took = cost_counter() - before - cost_of_looking();
            if (drive != drive_again) {
                console_write("cost_peers: the bank and the loop differ\n");
                console_exit(1);
            }
            if (!saturated) {
                const double error = miss(&model, &start, drive, wanted);
                score(&ours, ours_took, wanted, error);
                score(&loop, loop_took, wanted, error);
                score(&fpu, fpu_took, wanted, miss(&model, &start, to_q31(drive_single), wanted));
            }
        }
    }
    print("play_bank_this_library", operators, &ours);
    print("play_bank_loop_integer", operators, &loop);
    print("play_bank_loop_single_precision", operators, &fpu);
}

/* Direct form 2 transposed, as it is usually written in single precision. */
static float single_cascade(const float c[SECTIONS][5], float state[SECTIONS][2], float x) {
    for (unsigned i = 0; i < SECTIONS; i++) {
        const float y = c[i][0] * x + state[i][0];
        state[i][0] = c[i][1] * x - c[i][3] * y + state[i][1];
        state[i][1] = c[i][2] * x - c[i][4] * y;
        x = y;
    }
    return x;
}

static double double_cascade(const hyst_iir_section_t section[SECTIONS], double past[SECTIONS][4], double x) {
    for (unsigned i = 0; i < SECTIONS; i++) {
        const hyst_iir_section_t *s = &section[i];
        const double y =
            0x1p-28 * (s->b0 * x + s->b1 * past[i][0] + s->b2 * past[i][1] - s->a1 * past[i][2] - s->a2 * past[i][3]);
        past[i][1] = past[i][0];
        past[i][0] = x;
        past[i][3] = past[i][2];
        past[i][2] = y;
        x = y;
    }
    return x;
}

static void compare_filters(generator_t *generator) {
    /* A resonance at a fiftieth of the sample rate, damping 0.2, twice undone and twice done: gain 1 at rest. */
    static const hyst_iir_section_t section[SECTIONS] = {{4138137, 4138137, 0, -518149700, 257990518},
                                                         {4138137, 4138137, 0, -518149700, 257990518},
                                                         {HYST_Q28_ONE / 4, 0, 0, -HYST_Q28_ONE / 4 * 3, 0},
                                                         {HYST_Q28_ONE / 2, 0, 0, -HYST_Q28_ONE / 2, 0}};
    static hyst_iir_t iir;
    static hyst_iir_state_t state;
    static float coefficient[SECTIONS][5], past_single[SECTIONS][2];
    static double past[SECTIONS][4];
    score_t ours = {.worst = 0};
    score_t fpu = {.worst = 0};
    uint32_t element;
    if (hyst_iir_build(&iir, SECTIONS, section, &element) != HYST_IIR_OK) {
        console_write("cost_peers: the filter is refused\n");
        console_exit(1);
    }
    hyst_iir_reset(&state);
    for (unsigned i = 0; i < SECTIONS; i++) {
        const hyst_q28_t q[5] = {section[i].b0, section[i].b1, section[i].b2, section[i].a1, section[i].a2};
        for (unsigned j = 0; j < 5; j++) {
            coefficient[i][j] = (float)q[j] * 0x1p-28F;
        }
    }
    excitation_t excitation = {0};
    for (unsigned k = 0; k < MODELS * SAMPLES; k++) {
        const hyst_q31_t x = generate_signal(generator, &excitation) / 8;
        bool saturated = false;
        uint32_t before = cost_counter();
        const hyst_q31_t y = hyst_iir_step(&iir, &state, x, &saturated);
        const uint32_t ours_took = cost_counter() - before - cost_of_looking();
        const float x_single = (float)x;
        before = cost_counter();
        const float y_single = single_cascade(coefficient, past_single, x_single);
        const uint32_t fpu_took = cost_counter() - before - cost_of_looking();
        const double exact = double_cascade(section, past, x);
        score(&ours, ours_took, y, y - exact);
        score(&fpu, fpu_took, y, (double)y_single - exact);
    }
    print("biquads_this_library", SECTIONS, &ours);
    print("biquads_single_precision", SECTIONS, &fpu);
}

int main(void) {
    generator_t generator = {.state = 1};
    static const uint32_t operators[] = {4, 16, 64, 256};
    for (unsigned i = 0; i < sizeof operators / sizeof operators[0]; i++) {
        compare_banks(&generator, operators[i]);
    }
    compare_filters(&generator);
    console_exit(0);
}
