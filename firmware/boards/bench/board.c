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
#include "loop.h"
#include "modbus_line.h"
#include "startup.h"
#include "stm32f405.h"

#define QEMU_TIMER_HZ 1000000000U
#define QEMU_CORE_HZ  168000000U
#define APB2_HZ       84000000U /* for the baud rate, which the emulation ignores */

const board_info_t board_info = {
    .id = 2,
    .latency_samples = 1,
    .position_bits = 16,
    .drive_bits = 16,
    .sample_rate_mhz = 10000000, /* the twin's sample period is 100 us of its own time */
    .cost_rate_hz = QEMU_TIMER_HZ,
    /* Bytes arrive when the host's scheduler lets QEMU read them, so the pauses within a frame are not the line's. Next
     * to two busy processes on two cores, 5 ms cut a third of the uploads' frames and 20 ms one in thirty. */
    .modbus_silence_us = 20000,
};

/* Long enough for the host to deliver the next byte, if there is one: some 100 us. */
#define RECEIVE_LOOKS 400U

/* One code crosses the line as three bytes; only the first has bit 7 set, so a lost byte costs one sample and no more.
 */
static struct {
    uint32_t code;
    unsigned bytes;
} arriving;

uint16_t board_init(void) {
    RCC->APB1ENR |= RCC_APB1ENR_TIM2 | RCC_APB1ENR_TIM5 | RCC_APB1ENR_USART2;
    TIM5->CR1 = TIM_CR1_CEN;
    TIM2->PSC = QEMU_TIMER_HZ / 1000000U - 1U;
    TIM2->CR1 = TIM_CR1_CEN;
    SYSTICK->RVR = QEMU_CORE_HZ / 1000U - 1U;
    SYSTICK->CSR = SYSTICK_CSR_ENABLE | SYSTICK_CSR_TICKINT | SYSTICK_CSR_CLKSOURCE;
    modbus_line_init(APB2_HZ);
    return 0;
}

void board_start(void) {
    USART2->CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
    nvic_enable(IRQ_USART2, PRIORITY_SAMPLE);
}

/* The emulated transmitter is always ready. */
static void send_code(uint16_t code) {
    USART2->DR = 0x80U | (uint32_t)code >> 14;
    USART2->DR = (uint32_t)code >> 7 & 0x7FU;
    USART2->DR = (uint32_t)code & 0x7FU;
}

/* Returns whether the byte completed a code; the answer is sent then. */
static bool receive(uint32_t byte) {
    if ((byte & 0x80U) != 0) {
        arriving.code = 0;
        arriving.bytes = 0;
    }
    arriving.code = arriving.code << 7 | (byte & 0x7FU);
    arriving.bytes++;
    if (arriving.bytes != 3) {
        return false;
    }
    const loop_input_t input = {.position_code = (uint16_t)arriving.code};
    send_code(loop_sample(&input));
    return true;
}

/*
 * The loop, once for every three bytes. QEMU hands over one byte at a time, and waking the emulated processor for each
 * costs more than the loop itself; so, after the first, the interrupt looks for the others for a while. A code cut
 * short is finished by later interrupts.
 */
void usart2_handler(void) {
    bool complete = false;
    for (unsigned look = 0; look < RECEIVE_LOOKS && !complete; look++) {
        if ((USART2->SR & USART_SR_RXNE) != 0) {
            complete = receive(USART2->DR);
        }
    }
    /* The bytes that were fetched by looking have left the interrupt pending. Without this it would run again at once,
     * and the main loop never. A byte that is still waiting raises it again. */
    nvic_forget(IRQ_USART2);
}

/* Ends the sleep of board_idle; there is nothing else to do. */
void systick_handler(void) {
}

/* The output is the answer to the twin: without one, it stops. */
void outputs_to_safety(void) {
}

uint32_t board_cost_counter(void) {
    return TIM5->CNT;
}

uint32_t board_microseconds(void) {
    return TIM2->CNT;
}
