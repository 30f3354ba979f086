/* SPDX-License-Identifier: MIT */
/*
 * The h405's Modbus line, its own file on a chip made of variables (fake_chip.h): a node that drives the bus too long
 * stops everybody.
 */
#include "board.h"
#include "fake_chip.h"
#include "modbus_line.h"
#include "startup.h"
#include "unity.h"

enum { CLOCK_HZ = 84000000, DRIVER_PIN = 5 };

const board_info_t board_info = {.sample_rate_mhz = 10000000, .modbus_silence_us = 1750};

static const uint8_t answer[] = {1, 3, 2, 0x48, 0x59, 0x4E, 0x1E};
static uint8_t received;
static unsigned bytes, errors;

/* In place of the server. */
void modbus_server_receive(uint8_t byte) {
    received = byte;
    bytes++;
}

void modbus_server_line_error(void) {
    errors++;
}

void setUp(void) {
    fake_chip_power_on();
    bytes = errors = 0;
    modbus_line_init(CLOCK_HZ, true);
}
void tearDown(void) {
}

static void expect_to_listen(void) {
    TEST_ASSERT_EQUAL_HEX32(GPIO_BSRR_RESET(DRIVER_PIN), fake_chip.gpiob.BSRR);
    TEST_ASSERT_BITS_HIGH(USART_CR1_UE | USART_CR1_RE | USART_CR1_RXNEIE, fake_chip.usart1.CR1);
}

static void test_it_starts_as_a_listener(void) {
    expect_to_listen();
    TEST_ASSERT_EQUAL_HEX32(GPIO_MODE_OUTPUT, fake_chip.gpiob.MODER >> (2U * DRIVER_PIN) & 3U);
    TEST_ASSERT_EQUAL_UINT32(729, fake_chip.usart1.BRR);
    TEST_ASSERT_EQUAL_HEX32(0, fake_chip.usart1.CR1 & (USART_CR1_M | USART_CR1_PCE));
}

static void test_the_driver_is_on_for_an_answer_and_no_longer(void) {
    board_modbus_send(answer, sizeof answer);
    TEST_ASSERT_EQUAL_UINT(sizeof answer, fake_chip.sent_count);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(answer, fake_chip.sent, sizeof answer);
    TEST_ASSERT_TRUE(fake_chip.driven);
    TEST_ASSERT_TRUE_MESSAGE(fake_chip.deaf, "a transceiver that is on returns what is sent");
    expect_to_listen();
}

static void test_a_transmitter_that_is_stuck_leaves_the_bus_to_others(void) {
    fake_chip.transmits = false;
    board_modbus_send(answer, sizeof answer);
    TEST_ASSERT_EQUAL_UINT(0, fake_chip.sent_count);
    expect_to_listen();
}

static void test_a_full_duplex_line_is_heard_meanwhile(void) {
    modbus_line_init(CLOCK_HZ, false);
    board_modbus_send(answer, sizeof answer);
    TEST_ASSERT_FALSE(fake_chip.deaf);
}

static void arrive(uint32_t flags) {
    fake_chip.transmits = false; /* DR is what came */
    fake_chip.usart1.SR = USART_SR_RXNE | flags;
    fake_chip.usart1.DR = 0x5A;
    usart1_handler();
}

static void test_a_character_with_an_error_is_none(void) {
    static const uint32_t flags[] = {USART_SR_PE, USART_SR_FE, USART_SR_NF, USART_SR_ORE};
    arrive(0);
    TEST_ASSERT_EQUAL_HEX8(0x5A, received);
    TEST_ASSERT_EQUAL_UINT(1, bytes);
    for (unsigned i = 0; i < sizeof flags / sizeof flags[0]; i++) {
        arrive(flags[i]);
        TEST_ASSERT_EQUAL_UINT(i + 1U, errors);
        TEST_ASSERT_EQUAL_UINT(1, bytes);
    }
}

static void test_parity_is_a_ninth_bit(void) {
    enum { BITS = USART_CR1_M | USART_CR1_PCE | USART_CR1_PS };
    board_modbus_line(9600, LINE_PARITY_EVEN);
    TEST_ASSERT_EQUAL_UINT32(8750, fake_chip.usart1.BRR);
    TEST_ASSERT_EQUAL_HEX32(USART_CR1_M | USART_CR1_PCE, fake_chip.usart1.CR1 & BITS);
    board_modbus_send(answer, 1);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(USART_CR1_M | USART_CR1_PCE, fake_chip.usart1.CR1 & BITS, "after an answer, too");
    board_modbus_line(9600, LINE_PARITY_ODD);
    TEST_ASSERT_EQUAL_HEX32(BITS, fake_chip.usart1.CR1 & BITS);
    expect_to_listen();
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_it_starts_as_a_listener);
    RUN_TEST(test_the_driver_is_on_for_an_answer_and_no_longer);
    RUN_TEST(test_a_transmitter_that_is_stuck_leaves_the_bus_to_others);
    RUN_TEST(test_a_full_duplex_line_is_heard_meanwhile);
    RUN_TEST(test_a_character_with_an_error_is_none);
    RUN_TEST(test_parity_is_a_ninth_bit);
    return UNITY_END();
}
