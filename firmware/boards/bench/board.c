/* SPDX-License-Identifier: MIT */
/*
 * The application under `qemu-system-arm -M netduinoplus2`. First -serial: USART1, the Modbus line. Second -serial:
 * USART2, the converter line, on which `hyst twin` stands for converters and actuator, in lock step (docs/DESIGN.md,
 * section 6).
 *
 * Time. There is no sample clock here: the twin's next position is the next sample, whenever it comes, so the loop's
 * notion of time is exact however fast or slow the emulation runs. The twin holds drive k until it sends position k +
 * 1: latency_samples is 1.
 *
 * Limitations. QEMU 7.2 runs the timers from a fixed 1 GHz, whatever the clock control says, and has no cycle counter.
 * TIM5 therefore counts nanoseconds of QEMU's virtual time: under `-icount shift=0` that is executed instructions,
 * otherwise it follows the host's clock and says as much about the host as about the loop. It never counts processor
 * cycles.
 */
#include "board.h"
#include "loop/loop.h"
#include "modbus_line.h"
#include "startup.h"
#include "stm32f405.h"

#define QEMU_TIMER_HZ     1000000000U
#define QEMU_CORE_HZ      168000000U
#define HIGH_VOLTAGE_MOST 0xFFFFF   /* mV: 20 bits */
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

/* One code crosses the line as three bytes; only the first has bit 7 set, so a lost byte costs one sample and no more.
 */
static struct {
    uint32_t code;
    unsigned bytes;
} arriving;

/* The stage's supply in mV, four bits in the spare bits 5 to 2 of each code's first byte, the highest first; bit 6
 * marks the first of five. It counts when it has come twice alike: of two numbers that lost codes a third could be
 * made. */
#define SUPPLY_PARTS 5U
static struct {
    uint32_t bits, before;
    unsigned parts;
    int32_t mv;
} supply;

board_start_t board_init(void) {
    supply.parts = SUPPLY_PARTS;
    supply.mv = HEALTH_ABSENT;                    /* not sent yet */
    const last_run_t last = last_run_take(false); /* the emulator's memory begins as zeros */
    RCC->APB1ENR |= RCC_APB1ENR_TIM2 | RCC_APB1ENR_TIM5 | RCC_APB1ENR_USART2;
    TIM5->CR1 = TIM_CR1_CEN;
    TIM2->PSC = QEMU_TIMER_HZ / 1000000U - 1U;
    TIM2->CR1 = TIM_CR1_CEN;
    SYSTICK->RVR = QEMU_CORE_HZ / 1000U - 1U;
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
    return channel == HEALTH_HIGH_VOLTAGE ? supply.mv : HEALTH_ABSENT;
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

void board_start(uint16_t drive_code) {
    (void)drive_code; /* the first sample says it */
    USART2->CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
    nvic_enable(IRQ_USART2, PRIORITY_SAMPLE);
}

/* The emulated transmitter is always ready. */
static void send_code(uint16_t code) {
    USART2->DR = 0x80U | (uint32_t)code >> 14;
    USART2->DR = (uint32_t)code >> 7 & 0x7FU;
    USART2->DR = (uint32_t)code & 0x7FU;
}

/* Those five bits of a code. */
static void receive_supply(uint32_t spare) {
    if ((spare & 0x10U) != 0) {
        supply.bits = 0;
        supply.parts = 0;
    }
    if (supply.parts == SUPPLY_PARTS) {
        return; /* waits for a beginning */
    }
    supply.bits = supply.bits << 4 | (spare & 0xFU);
    supply.parts++;
    if (supply.parts == SUPPLY_PARTS) {
        supply.mv = supply.bits == supply.before ? (int32_t)supply.bits : supply.mv;
        supply.before = supply.bits;
    }
}

/* The byte that completes a code is answered. */
static void receive(uint32_t byte) {
    if ((byte & 0x80U) != 0) {
        arriving.code = 0;
        arriving.bytes = 0;
    }
    arriving.code = arriving.code << 7 | (byte & 0x7FU);
    arriving.bytes++;
    if (arriving.bytes == 3) {
        receive_supply(arriving.code >> 16 & 0x1FU);
        const loop_input_t input = {.position_code = (uint16_t)arriving.code};
        send_code(loop_sample(&input));
    }
}

/* The loop, once every three bytes. QEMU hands over one byte at a time, and a byte is one interrupt: one that looks for
 * the next byte by itself takes QEMU's lock, again and again, from the thread that is to bring it. */
void usart2_handler(void) {
    if ((USART2->SR & USART_SR_RXNE) != 0) {
        receive(USART2->DR);
    }
}

/* Ends the sleep of board_idle; there is nothing else to do. */
void systick_handler(void) {
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
