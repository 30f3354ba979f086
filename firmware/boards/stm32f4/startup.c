/* SPDX-License-Identifier: MIT */
#include "startup.h"
#include "stm32f405.h"

int main(void);
_Noreturn void reset_handler(void);
_Noreturn void stop(void);
void fault_handler(void);

/* Places of stm32f405.ld. Only their addresses mean anything. */
extern uint32_t stack_top[], data_image[], data_start[], data_end[], bss_start[], bss_end[];

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
    (void)main();
    stop();
}

_Noreturn void stop(void) {
    outputs_to_safety();
    for (;;) {
        __asm__ volatile("wfi");
    }
}

/* Naked, with a fresh stack: the fault may be that the old one ran out. Nothing returns from here. */
__attribute__((naked)) void fault_handler(void) {
    __asm__ volatile("cpsid i\n\t"
                     "ldr r0, =stack_top\n\t"
                     "msr msp, r0\n\t"
                     "b stop");
}

void systick_handler(void) __attribute__((weak, alias("fault_handler")));
void tim2_handler(void) __attribute__((weak, alias("fault_handler")));
void usart1_handler(void) __attribute__((weak, alias("fault_handler")));
void usart2_handler(void) __attribute__((weak, alias("fault_handler")));

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
        [IRQ_USART2] = usart2_handler,
        [IRQ_USART2 + 1 ... IRQ_COUNT - 1] = fault_handler,
    },
};
/* clang-format on */
