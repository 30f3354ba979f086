/* SPDX-License-Identifier: MIT */
#include "startup.h"
#include "stm32f405.h"

#define RECORD_MAGIC 0x48594654UL /* "HYFT" */
#define GUARD_BYTES  256U
#define FRAME_WORDS  8U

int main(void);
_Noreturn void reset_handler(void);
_Noreturn void stop(const uint32_t *frame);
void fault_handler(void);

/* Places of stm32f405.ld. Only their addresses mean anything. */
extern uint32_t stack_guard[], stack_top[], data_image[], data_start[], data_end[], bss_start[], bss_end[];

/* No access at all to the lowest bytes of the stack. What no region covers is as without protection. */
static void guard_stack(void) {
    MPU->RNR = 0;
    MPU->RBAR = (uint32_t)stack_guard;
    MPU->RASR = MPU_RASR_XN | MPU_RASR_256_BYTES | MPU_RASR_ENABLE;
    MPU->CTRL = MPU_CTRL_PRIVDEFENA | MPU_CTRL_ENABLE;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}

_Noreturn void reset_handler(void) {
    /* The code is compiled for the hard-float ABI: the compiler may keep integers in floating-point registers. */
    SCB_CPACR |= SCB_CPACR_FPU;
    __asm__ volatile("dsb\n\tisb" ::: "memory");

    const uint32_t *from = data_image;
    for (uint32_t *to = data_start; to < data_end; to++) {
        *to = *from++;
    }
    for (uint32_t *to = bss_start; to < bss_end; to++) {
        *to = 0;
    }
    guard_stack();
    (void)main();
    stop(stack_top);
}

/* Survives a reset. */
static struct {
    uint32_t magic, check; /* RECORD_MAGIC, and its complement with the rest mixed in */
    uint32_t starts, faulted, fault_address, fault_status;
} record __attribute__((section(".noinit")));

static uint32_t record_check(void) {
    return ~(record.magic ^ record.starts ^ record.faulted ^ record.fault_address ^ record.fault_status);
}

static void record_write(uint32_t starts, bool faulted, uint32_t address, uint32_t status) {
    record.magic = RECORD_MAGIC;
    record.starts = starts;
    record.faulted = faulted ? 1U : 0U;
    record.fault_address = address;
    record.fault_status = status;
    record.check = record_check();
}

static bool record_whole(void) {
    return record.magic == RECORD_MAGIC && record.check == record_check();
}

last_run_t last_run_take(bool power_came_on) {
    last_run_t last = {0};
    if (record_whole() && !power_came_on) {
        last = (last_run_t){record.starts, record.faulted != 0, record.fault_address, record.fault_status};
    }
    record_write(last.starts + 1U, false, 0, 0);
    return last;
}

/* `frame`: what the processor stacked when the fault came; the sixth word is the instruction's address. */
_Noreturn void stop(const uint32_t *frame) {
    const bool stacked = frame >= stack_guard + GUARD_BYTES / sizeof(uint32_t) && frame + FRAME_WORDS <= stack_top;
    record_write(record_whole() ? record.starts : 0, true, stacked ? frame[6] : 0, SCB_CFSR);
    outputs_to_safety();
    SCB_AIRCR = SCB_AIRCR_RESET;
    for (;;) {
        __asm__ volatile("wfi");
    }
}

/* Naked, with a fresh stack: the fault may be that the old one ran out. Nothing returns from here. */
__attribute__((naked)) void fault_handler(void) {
    __asm__ volatile("cpsid i\n\t"
                     "mrs r0, msp\n\t"
                     "ldr r1, =stack_top\n\t"
                     "msr msp, r1\n\t"
                     "b stop");
}

void systick_handler(void) __attribute__((weak, alias("fault_handler")));
void tim2_handler(void) __attribute__((weak, alias("fault_handler")));
void usart1_handler(void) __attribute__((weak, alias("fault_handler")));

typedef void (*handler_t)(void);

/* The first word is the initial stack pointer, the rest are handlers: 15 of the core, then one an interrupt. */
typedef struct {
    uint32_t *stack_top;
    handler_t core[15];
    handler_t interrupt[IRQ_COUNT];
} vectors_t;

extern const vectors_t vectors;
/* clang-format off */
__attribute__((section(".vectors"), used)) const vectors_t vectors = {
    .stack_top = stack_top,
    .core = {reset_handler,                                                  /* reset */
             fault_handler, fault_handler,                                   /* NMI, hard fault */
             fault_handler, fault_handler, fault_handler, 0, 0, 0, 0,        /* memory, bus and usage fault */
             fault_handler, fault_handler, 0, fault_handler, systick_handler}, /* SVCall, debug, PendSV, SysTick */
    .interrupt = {
        [0 ... IRQ_TIM2 - 1] = fault_handler,
        [IRQ_TIM2] = tim2_handler,
        [IRQ_TIM2 + 1 ... IRQ_USART1 - 1] = fault_handler,
        [IRQ_USART1] = usart1_handler,
        [IRQ_USART1 + 1 ... IRQ_COUNT - 1] = fault_handler,
    },
};
/* clang-format on */
