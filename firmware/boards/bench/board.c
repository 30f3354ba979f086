/* SPDX-License-Identifier: MIT */
/*
 * The application under `qemu-system-arm -M netduinoplus2`. First -serial: USART1, the Modbus line. The converter line
 * goes by semihosting, through two pipes on which `hyst twin` stands for converters and actuator, in lock step
 * (docs/DESIGN.md, section 6). That is one system call of the emulator each way. A byte of an emulated serial line
 * takes it some fifteen.
 *
 * Time. There is no sample clock here: the twin's next position is the next sample, whenever it comes, so the loop's
 * notion of time is exact however fast or slow the emulation runs. The twin holds drive k until it sends position k +
 * 1: latency_samples is 1. The interrupt that runs the loop is the core's tick, once a millisecond: it takes all
 * samples that are due, one after the other, and interrupts the main loop anywhere.
 *
 * Limitations. QEMU 7.2 runs the timers from a fixed 1 GHz, whatever the clock control says, and has no cycle counter.
 * TIM5 therefore counts nanoseconds of QEMU's virtual time: under `-icount shift=0` that is executed instructions,
 * otherwise it follows the host's clock and says as much about the host as about the loop. It never counts processor
 * cycles.
 */
#include "board.h"
#include "loop/loop.h"
#include "modbus_line.h"
#include "semihosting.h"
#include "startup.h"
#include "stm32f405.h"
#include <string.h>

#define QEMU_TIMER_HZ     1000000000U
#define QEMU_CORE_HZ      168000000U
#define TICK_US           1000U
#define HIGH_VOLTAGE_MOST 0xFFFFF   /* mV: above any stage for piezos */
#define APB2_HZ           84000000U /* for the baud rate, which the emulation ignores */

const board_info_t board_info = {
    .id = BOARD_ID,
    .latency_samples = 1,
    .sampled_after_ns = 1000000000U / SAMPLE_RATE_HZ, /* the twin moves on for a period, then its position is read */
    .position_bits = 16,
    .drive_bits = 16,
    .sample_rate_mhz = SAMPLE_RATE_HZ * 1000U, /* the twin's sample period in simulated time */
    .cost_rate_hz = QEMU_TIMER_HZ,
    /* Bytes arrive when the host's scheduler lets QEMU read them, so the pauses within a frame are not the line's. Next
     * to two busy processes on two cores, 5 ms cut a third of the uploads' frames and 20 ms one in thirty. */
    .modbus_silence_us = 20000,
    .modbus_ends_at_length = true, /* and not each request waits for that: one master, and no line that loses a byte */
    .safe_code = 0,
    /* As the h405's. */
    .drive_slew_max = BOARD_RANGE_IN_US(800, SAMPLE_RATE_HZ),
    .fault_slew_min = BOARD_RANGE_IN_US(500000, SAMPLE_RATE_HZ),
    /* The stage's supply is what the twin says. Which one is wrong depends on the actuator: the master sets limits. */
    .health = {.high_voltage_low = 0, .high_voltage_high = HIGH_VOLTAGE_MOST},
    .image_limits = {.transition_slew_min = BOARD_RANGE_IN_US(10000000, SAMPLE_RATE_HZ),
                     .transition_slew_max = BOARD_RANGE_IN_US(10000, SAMPLE_RATE_HZ),
                     .filter_gain_max = 64},
};

/* What crosses the line (host_tools/bench/converter_line.h has the twin's side). */
typedef struct {
    uint16_t drive_code; /* of the first ask, which has none: the rate of the loop in Hz */
    uint16_t answers;    /* 1: the last position. 0: it only asks for one */
} ask_t;
typedef struct {
    uint16_t position_code;
    uint16_t there;     /* 0: the next sample is not due yet */
    uint32_t supply_mv; /* of the stage, 0 not measured */
} answer_t;

static struct {
    intptr_t asks, answers; /* files of the emulator's */
    ask_t ask;
    bool open;
} line = {.ask = {.drive_code = SAMPLE_RATE_HZ <= UINT16_MAX ? SAMPLE_RATE_HZ : 0}};
static int32_t supply_mv = HEALTH_ABSENT; /* not sent yet */

board_start_t board_init(void) {
    const last_run_t last = last_run_take(false); /* the emulator's memory begins as zeros */
    RCC->APB1ENR |= RCC_APB1ENR_TIM2 | RCC_APB1ENR_TIM5;
    TIM5->CR1 = TIM_CR1_CEN;
    TIM2->PSC = QEMU_TIMER_HZ / 1000000U - 1U;
    TIM2->CR1 = TIM_CR1_CEN;
    SYSTICK->RVR = QEMU_CORE_HZ / 1000000U * TICK_US - 1U;
    SYSTICK->CSR = SYSTICK_CSR_ENABLE | SYSTICK_CSR_TICKINT | SYSTICK_CSR_CLKSOURCE;
    /* A pseudo-terminal has two directions, and hands the next request over in the very moment in which the answer's
     * last byte is written. */
    modbus_line_init(APB2_HZ, false);
    return (board_start_t){.reset_cause = last.faulted ? RESET_FAULT | RESET_SOFTWARE : RESET_POWER,
                           .starts = (uint16_t)(last.starts + 1U),
                           .fault_address = last.fault_address,
                           .fault_status = last.fault_status};
}

int32_t board_health(health_channel_t channel) {
    return channel == HEALTH_HIGH_VOLTAGE ? supply_mv : HEALTH_ABSENT;
}

/* The twin is the converter. */
bool board_output_follows(void) {
    return true;
}

void board_health_convert(void) {
}

/* As an h405's, so that an image is refused here as it is there. The emulator has no such clock. */
uint32_t board_core_hz(void) {
    return QEMU_CORE_HZ;
}

/* There is no stage, and no hardware watchdog in QEMU 7.2. */
void board_stage_enable(bool on) {
    (void)on;
}

void board_keep_park(uint16_t drive_code) {
    (void)drive_code; /* outputs_to_safety has no output */
}

void board_watchdog_feed(void) {
}

/* Memory that a reset leaves alone, in place of flash, which QEMU 7.2 cannot program. It begins as zeros: no copy is
 * whole. */
static uint32_t store[BOARD_STORE_SECTORS][BOARD_STORE_WORDS] __attribute__((section(".noinit")));

const uint32_t *board_store_sector(unsigned sector) {
    return store[sector];
}

bool board_store_erase(unsigned sector) {
    for (size_t i = 0; i < BOARD_STORE_WORDS; i++) {
        store[sector][i] = UINT32_MAX;
    }
    return true;
}

bool board_store_program(unsigned sector, size_t word, uint32_t value) {
    store[sector][word] &= value;
    return true;
}

/* Opens the file of the next name in a list, and ends the name in place. */
static intptr_t open_next(char **list, uintptr_t mode) {
    char *const name = *list;
    const uintptr_t length = strcspn(name, " ");
    *list += name[length] == ' ' ? length + 1U : length;
    name[length] = '\0';
    const uintptr_t block[] = {(uintptr_t)name, mode, length};
    return semihosting(SYS_OPEN, (uintptr_t)block);
}

void board_start(uint16_t drive_code) {
    static char names[256];
    const uintptr_t block[] = {(uintptr_t)names, sizeof names};
    char *next = names;
    (void)drive_code; /* the first sample says it */
    (void)semihosting(SYS_GET_CMDLINE, (uintptr_t)block);
    line.asks = open_next(&next, SEMIHOSTING_WRITE);
    line.answers = open_next(&next, SEMIHOSTING_READ);
    line.open = line.asks >= 0 && line.answers >= 0; /* from here on, the interrupt's */
}

/* Whether all of it went through: what is left over of `size` is 0. */
static bool transfer(uint32_t operation, intptr_t file, void *memory, uint32_t size) {
    const uintptr_t block[] = {(uintptr_t)file, (uintptr_t)memory, size};
    return semihosting(operation, (uintptr_t)block) == 0;
}

/* Whether there was a sample. The twin answers every ask at once, so that the emulator does not stand still. */
static bool sample(void) {
    answer_t answer = {.there = 0};
    const bool there = transfer(SYS_WRITE, line.asks, &line.ask, sizeof line.ask) &&
                       transfer(SYS_READ, line.answers, &answer, sizeof answer) && answer.there != 0;
    line.ask.answers = 0;
    if (there) {
        supply_mv = answer.supply_mv != 0 ? (int32_t)answer.supply_mv : HEALTH_ABSENT;
        const loop_input_t input = {.position_code = answer.position_code};
        line.ask = (ask_t){.drive_code = loop_sample(&input), .answers = 1};
    }
    return there;
}

/* The loop: the samples that are due, once a millisecond. Half of the time is the main loop's and, while that sleeps,
 * of the emulator's thread that brings the bytes of the Modbus line. */
void systick_handler(void) {
    const uint32_t begun = TIM2->CNT;
    while (line.open && sample() && TIM2->CNT - begun < TICK_US / 2U) {
    }
}

/* The output is the answer to the twin: without one it keeps the last code, until the next start answers. */
void outputs_to_safety(void) {
}

uint32_t board_cost_counter(void) {
    return TIM5->CNT;
}

uint32_t board_microseconds(void) {
    return TIM2->CNT;
}
