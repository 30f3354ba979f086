/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Everything that the build has found declares all that its users need, and stands where its keys put it. Where one
 * leaves something out, the contract says what. */
#include "chain/catalogue.h"
#include "commands/command.h"
#include "contract.h"
#include "unity.h"
#include <string.h>

static char text[CONTRACT_TEXT];

void setUp(void) {
    text[0] = '\0';
}
void tearDown(void) {
}

static void test_blocks_are_complete(void) {
    size_t missing = 0;
    for (size_t i = 0; i < catalogue_count; i++) {
        missing += contract_block(catalogue[i], text);
    }
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, missing, text);
}

static void test_families_are_complete(void) {
    size_t missing = 0;
    for (size_t i = 0; i < families_count; i++) {
        missing += contract_family(families[i], text);
    }
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, missing, text);
}

static void test_commands_are_complete(void) {
    size_t missing = 0;
    for (size_t i = 0; i < commands_count; i++) {
        missing += contract_command(commands[i], text);
    }
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, missing, text);
}

static void test_faults_are_complete(void) {
    size_t missing = 0;
    TEST_ASSERT_TRUE(fault_kind_count > 0);
    for (size_t i = 0; i < fault_kind_count; i++) {
        missing += contract_fault(fault_kinds[i], text);
    }
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, missing, text);
}

/* The build reads the keys from the sources; here they are what the compiler made of them. */
static void test_lists_are_in_the_order_of_their_keys(void) {
    for (size_t i = 1; i < catalogue_count; i++) {
        const block_t *before = catalogue[i - 1], *block = catalogue[i];
        TEST_ASSERT_TRUE_MESSAGE(before->place < block->place ||
                                     (before->place == block->place && before->order < block->order),
                                 block->name);
    }
    for (size_t i = 1; i < families_count; i++) {
        TEST_ASSERT_TRUE_MESSAGE(families[i - 1]->order < families[i]->order, families[i]->name);
    }
    for (size_t i = 1; i < commands_count; i++) {
        TEST_ASSERT_TRUE_MESSAGE(commands[i - 1]->order < commands[i]->order, commands[i]->name);
    }
    for (size_t i = 1; i < fault_kind_count; i++) {
        TEST_ASSERT_TRUE_MESSAGE(fault_kinds[i - 1]->order < fault_kinds[i]->order, fault_kinds[i]->name);
    }
}

static void expect(const char *const *lines, size_t count, size_t missing) {
    for (size_t i = 0; i < count; i++) {
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, lines[i]), lines[i]);
    }
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(count, missing, text);
}

static void test_what_a_block_leaves_out_is_named(void) {
    static const parameter_info_t parameters[] = {{.name = "gamma"},
                                                  {.name = "gamma", .unit = "1", .high = 1.0, .text = "again"}};
    static const probe_t probe = {.searched = 1U << 2, .together = {"no_such"}, .doubtful = {"nor_this", "gamma", "x"}};
    static const block_t block = {
        .name = "Half", .parameter = parameters, .parameters = 2, .lag = LAG_DELAY, .twin = "creep", .probe = &probe};
    static const char *const lines[] = {"block Half: its name is not",
                                        "block Half: no text",
                                        "no order",
                                        "parameter gamma: no unit",
                                        "parameter gamma: no text",
                                        "parameter gamma: no range",
                                        "parameter gamma: twice",
                                        "no simulation",
                                        "either compile, or uncorrected",
                                        "lag: not one parameter",
                                        "creep does not name it",
                                        "creep is not the same lag",
                                        "probe: no group",
                                        "probe: no explanation",
                                        "probe: no excitation",
                                        "probe: no parts",
                                        "probe: no instances",
                                        "probe: searches a parameter",
                                        "probe: together: no block no_such",
                                        "probe: doubtful: no block nor_this"};
    expect(lines, sizeof lines / sizeof lines[0], contract_block(&block, text));
}

static void test_what_an_empirical_block_leaves_out_is_named(void) {
    static const probe_t probe = {.searched = 0};
    block_t block = *catalogue_find("creep");
    static const char *const lines[] = {"empirical: a probe, too", "empirical: its name does not begin with empirical_",
                                        "empirical: nothing is searched"};
    block.empirical = &probe;
    expect(lines, 3, contract_block(&block, text));
    static const char *const searched[] = {"probe: no explanation", "probe: no excitation", "probe: no instances",
                                           "empirical: nothing is searched"};
    text[0] = '\0';
    block.name = "empirical_creep";
    block.probe = NULL;
    expect(searched, 4, contract_block(&block, text));
}

static void test_operators_need_their_parameters(void) {
    block_t block = *catalogue_find("creep");
    static const char *const plays[] = {"no parameter weights", "no parameter thresholds_v",
                                        "no parameter initial_memory_v"};
    static const char *const relays[] = {"no parameter levels_v", "no parameter everett_um", "no parameter past_v"};
    block.operators = OPERATORS_PLAYS;
    expect(plays, 3, contract_block(&block, text));
    text[0] = '\0';
    block.operators = OPERATORS_RELAYS;
    expect(relays, 3, contract_block(&block, text));
}

static void test_what_others_leave_out_is_named(void) {
    static const family_t family = {0};
    static const command_t command = {.name = "half"};
    static const char *const of_family[] = {"family ?: no name", "no text", "no order", "no fit"};
    static const char *const of_command[] = {
        "command half: no order", "no arguments", "no summary", "no details", "no run", "no examples"};
    expect(of_family, 4, contract_family(&family, text));
    text[0] = '\0';
    expect(of_command, 6, contract_command(&command, text));
    text[0] = '\0';
    static const fault_kind_t kind = {.name = "half"};
    static const char *const of_fault[] = {"fault half: no order", "no text", "no statistic", "no change", "no find"};
    expect(of_fault, 5, contract_fault(&kind, text));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_blocks_are_complete);
    RUN_TEST(test_families_are_complete);
    RUN_TEST(test_commands_are_complete);
    RUN_TEST(test_faults_are_complete);
    RUN_TEST(test_lists_are_in_the_order_of_their_keys);
    RUN_TEST(test_what_a_block_leaves_out_is_named);
    RUN_TEST(test_what_an_empirical_block_leaves_out_is_named);
    RUN_TEST(test_operators_need_their_parameters);
    RUN_TEST(test_what_others_leave_out_is_named);
    return UNITY_END();
}
