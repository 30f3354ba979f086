/* SPDX-License-Identifier: MIT */
/*
 * Instructions a call of hyst_compensator_step takes on the emulated Cortex-M4, in compensate mode. Under `-icount
 * shift=0` QEMU's virtual time advances one nanosecond an instruction, and its TIM5 counts nanoseconds. Instructions
 * are not cycles: a Cortex-M4 takes more than one for loads, taken branches and divisions, and waits for flash.
 * docs/TIMING.md says what to make of the numbers.
 */
#include "conformance.h"
#include "console.h"
#include "stm32f405.h"

#define MODELS  16U
#define SAMPLES 1000U

typedef struct {
    uint32_t worst;
    uint64_t sum;
    uint32_t calls;
} cost_t;

/* What reading the counter twice costs with nothing in between. */
static uint32_t reading(void) {
    const uint32_t before = TIM5->CNT;
    return TIM5->CNT - before;
}

static void measure(cost_t *cost, generator_t *generator, const hyst_compensator_t *compensator) {
    static hyst_compensator_state_t state;
    excitation_t excitation = {0};
    hyst_compensator_reset(compensator, &state);
    for (unsigned k = 0; k < SAMPLES; k++) {
        const hyst_q31_t reference = generate_signal(generator, &excitation);
        unsigned events = 0;
        const uint32_t before = TIM5->CNT;
        (void)hyst_compensator_step(compensator, &state, HYST_MODE_COMPENSATE, reference, &events);
        const uint32_t taken = TIM5->CNT - before - reading();
        cost->worst = taken > cost->worst ? taken : cost->worst;
        cost->sum += taken;
        cost->calls++;
    }
}

static void print_number(uint32_t number) {
    char text[12];
    unsigned at = sizeof text;
    text[--at] = '\0';
    unsigned digits = 0;
    do {
        text[--at] = (char)('0' + number % 10U);
        number /= 10U;
        digits++;
    } while (number > 0);
    while (digits++ < 10U) {
        text[--at] = ' ';
    }
    console_write(&text[at]);
}

int main(void) {
    static const uint32_t operators[] = {0, 10, 16, 64, HYST_PI_MAX_OPERATORS};
    static hyst_parameters_t p;
    static hyst_compensator_t compensator;
    generator_t generator = {.state = 1};

    console_write(" operators      rate  sections     worst      mean\n");
    for (unsigned n = 0; n < sizeof operators / sizeof operators[0]; n++) {
        for (unsigned variant = 0; variant < 4; variant++) {
            const bool rate_dependent = (variant & 1U) != 0;
            const uint32_t sections = (variant & 2U) != 0 ? 2 : 0;
            cost_t cost = {0};
            for (unsigned model = 0; model < MODELS; model++) {
                generate_parameters(&generator, &p);
                generate_hysteresis(&generator, &p, operators[n], rate_dependent);
                p.shape_sections = sections;
                p.equalise_sections = sections;
                build(&p, &compensator);
                measure(&cost, &generator, &compensator);
            }
            print_number(operators[n]);
            console_write(rate_dependent ? "       yes" : "        no");
            print_number(2U * sections);
            print_number(cost.worst);
            print_number((uint32_t)(cost.sum / cost.calls));
            console_write("\n");
        }
    }
    console_exit(0);
}
