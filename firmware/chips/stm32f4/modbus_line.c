/* SPDX-License-Identifier: MIT */
#include "modbus_line.h"
#include "board.h"
#include "startup.h"
#include "stm32f405.h"

#define PIN_DRIVER_ENABLE 5U /* PB5 */
#define PIN_TRANSMIT      6U /* PB6, alternate function 7 */
#define PIN_RECEIVE       7U /* PB7, alternate function 7 */
#define ALTERNATE_USART1  7UL

/* A byte takes 1.2 ms at 9600 baud; a look takes 8 cycles of the processor or more: 4.7 ms at least. */
#define TRANSMIT_LOOKS 100000U

static bool deaf_while_sending;
static uint32_t clock_hz;    /* of the bus USART1 sits on */
static uint32_t parity_bits; /* of CR1: with parity, a character has one bit more */

static void wait_for_transmitter(uint32_t flag) {
    for (unsigned look = 0; look < TRANSMIT_LOOKS && (USART1->SR & flag) == 0; look++) {
    }
}

static void listen(bool on) {
    const uint32_t others = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | parity_bits;
    USART1->CR1 = on ? others | USART_CR1_RXNEIE : others;
}

bool board_modbus_baud_possible(uint32_t baud) {
    return line_divider(clock_hz, baud) != 0;
}

void board_modbus_line(uint32_t baud, line_parity_t parity) {
    static const uint32_t bits[] = {[LINE_PARITY_NONE] = 0,
                                    [LINE_PARITY_EVEN] = USART_CR1_M | USART_CR1_PCE,
                                    [LINE_PARITY_ODD] = USART_CR1_M | USART_CR1_PCE | USART_CR1_PS};
    USART1->CR1 = 0; /* these bits may only be changed while it is off */
    USART1->BRR = line_divider(clock_hz, baud);
    parity_bits = bits[parity];
    listen(true);
}

void modbus_line_init(uint32_t apb2_hz, bool half_duplex) {
    const line_settings_t standard = LINE_SETTINGS_DEFAULT;
    deaf_while_sending = half_duplex;
    RCC->AHB1ENR |= RCC_AHB1ENR_GPIOB;
    RCC->APB2ENR |= RCC_APB2ENR_USART1;

    GPIOB->BSRR = GPIO_BSRR_RESET(PIN_DRIVER_ENABLE);
    GPIOB->AFR[0] |= ALTERNATE_USART1 << (4U * PIN_TRANSMIT) | ALTERNATE_USART1 << (4U * PIN_RECEIVE);
    GPIOB->PUPDR |= GPIO_PULL_UP << (2U * PIN_RECEIVE); /* an open input is an idle line */
    GPIOB->MODER |= GPIO_MODE_OUTPUT << (2U * PIN_DRIVER_ENABLE) | GPIO_MODE_ALTERNATE << (2U * PIN_TRANSMIT) |
                    GPIO_MODE_ALTERNATE << (2U * PIN_RECEIVE);

    clock_hz = apb2_hz;
    /* No effect on silicon, where TXE is set by reset; QEMU 7.2 finds its transmitter empty only after a write here. */
    USART1->SR = 0;
    board_modbus_line(standard.baud, (line_parity_t)standard.parity);
    nvic_enable(IRQ_USART1, PRIORITY_MODBUS);
}

void board_modbus_send(const uint8_t *frame, size_t length) {
    listen(!deaf_while_sending);
    GPIOB->BSRR = GPIO_BSRR_SET(PIN_DRIVER_ENABLE);
    for (size_t i = 0; i < length; i++) {
        wait_for_transmitter(USART_SR_TXE);
        USART1->DR = frame[i]; /* reading SR, then writing DR, clears TC */
    }
    wait_for_transmitter(USART_SR_TC);
    GPIOB->BSRR = GPIO_BSRR_RESET(PIN_DRIVER_ENABLE);
    if (deaf_while_sending && (USART1->SR & USART_SR_ORE) != 0) {
        (void)USART1->DR; /* reading SR, then DR, clears the overrun and drops the byte */
    }
    listen(true);
}

/* Period: a byte, 87 us at 115200 baud. Deadline: the next byte. On an overrun the byte is lost, and firmware/app drops
 * the frame. */
void usart1_handler(void) {
    const uint32_t status = USART1->SR;
    const uint8_t byte = (uint8_t)USART1->DR; /* reading SR, then DR, clears the error bits */
    if ((status & (USART_SR_PE | USART_SR_FE | USART_SR_NF | USART_SR_ORE)) != 0) {
        modbus_server_line_error();
    } else {
        modbus_server_receive(byte);
    }
}
