/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Model files: what is read is what was written, and everything else is refused with one line that says where. */
#include "chain/catalogue.h"
#include "chain/model.h"
#include "support.h"
#include "unity.h"
#include <gsl/gsl_math.h>
#include <stdio.h>
#include <string.h>

static const char file[] = "test_model.json";

void setUp(void) {
}
void tearDown(void) {
    remove(file);
}

static bool read_text(model_t *model, const char *text, failure_t *failure) {
    write_file(file, text, strlen(text));
    return model_read(model, file, failure);
}

static void test_write_then_read_gives_the_same_model(void) {
    const double weights[] = {0.1, 1.0 / 3.0, -0.02}, sigmas[] = {1e-3, HUGE_VAL, 0.0}, thresholds[] = {0.1, M_PI};
    const double frequency_hz = 812.3, unknown = HUGE_VAL; /* not determined: null in the file */
    model_t written, read, copy;
    failure_t failure;
    make_bank_model(&written, 9999.5, -1.0 / 7.0, 2, weights, thresholds);
    model_set_array(&written.block[0], "weights", 3, weights, sigmas);
    model_set_array(model_append(&written, &block_resonance), "frequency_hz", 1, &frequency_hz, &unknown);
    model_set(&written.block[1], "damping_ratio", 0.02);
    written.fit = json_pack("{s:[f,f], s:s}", "drive_range_v", -1.5, 2.5, "note", "kept");
    TEST_ASSERT_TRUE(model_write(&written, file, &failure));
    TEST_ASSERT_TRUE_MESSAGE(model_read(&read, file, &failure), failure.text);
    model_copy(&copy, &read);
    model_free(&read);
    TEST_ASSERT_EQUAL_UINT64(2, copy.blocks);
    TEST_ASSERT_TRUE(copy.sample_rate_hz == 9999.5);
    TEST_ASSERT_EQUAL_MEMORY(weights, model_parameter(&copy.block[0], "weights")->value, sizeof weights);
    TEST_ASSERT_EQUAL_MEMORY(sigmas, model_parameter(&copy.block[0], "weights")->sigma, sizeof sigmas);
    TEST_ASSERT_EQUAL_MEMORY(thresholds, model_parameter(&copy.block[0], "thresholds_v")->value, sizeof thresholds);
    TEST_ASSERT_TRUE(model_parameter(&copy.block[0], "offset_um")->value[0] == -1.0 / 7.0);
    TEST_ASSERT_EQUAL_UINT64(0, model_parameter(&copy.block[0], "initial_memory_v")->count);
    TEST_ASSERT_NULL(model_parameter(&copy.block[0], "offset_um")->sigma);
    TEST_ASSERT_TRUE(model_parameter(model_find(&copy, "resonance"), "frequency_hz")->value[0] == 812.3);
    TEST_ASSERT_TRUE(model_parameter(model_find(&copy, "resonance"), "frequency_hz")->sigma[0] == HUGE_VAL);
    TEST_ASSERT_TRUE(json_equal(written.fit, copy.fit));
    model_free(&written);
    model_free(&copy);
}

/* For readers of the file: what is not determined says so in words. */
static void test_says_what_is_not_determined(void) {
    const double weights[] = {0.1, 0.2}, sigmas[] = {1e-3, HUGE_VAL}, thresholds[] = {0.1}, lost = HUGE_VAL, kept = 1.0,
                 cutoff_hz = 50.0;
    model_t model;
    make_bank_model(&model, 1000.0, 0.0, 1, weights, thresholds);
    model_set_array(&model.block[0], "weights", 2, weights, sigmas);
    model_set_array(&model.block[0], "offset_um", 1, &kept, &kept);
    model_set_array(model_append(&model, &block_sensor_bandwidth), "cutoff_hz", 1, &cutoff_hz, &lost);
    json_t *json = model_to_json(&model);
    const json_t *chain = json_object_get(json, "chain");
    const json_t *bank = json_object_get(json_array_get(chain, 0), "parameters");
    const json_t *lag = json_object_get(json_array_get(chain, 1), "parameters");
    const json_t *each = json_object_get(json_object_get(bank, "weights"), "determined");
    TEST_ASSERT_TRUE(json_is_true(json_array_get(each, 0)) && json_is_false(json_array_get(each, 1)));
    TEST_ASSERT_NULL(json_object_get(json_object_get(bank, "offset_um"), "determined"));
    TEST_ASSERT_TRUE(json_is_false(json_object_get(json_object_get(lag, "cutoff_hz"), "determined")));
    TEST_ASSERT_TRUE(json_is_null(json_object_get(json_object_get(lag, "cutoff_hz"), "sigma")));
    json_decref(json);
    model_free(&model);
}

static void test_reads_bare_values_and_defaults(void) {
    model_t model;
    failure_t failure;
    TEST_ASSERT_TRUE_MESSAGE(
        read_text(
            &model,
            "{\"format\":\"hyst-model-1\",\"sample_rate_hz\":100,\"chain\":["
            "{\"block\":\"rate_dependent_hysteresis\",\"parameters\":{\"beta_s\":1e-3}},"
            "{\"block\":\"prandtl_ishlinskii\",\"parameters\":{\"offset_um\":1,\"weights\":[2],\"thresholds_v\":[]}}]}",
            &failure),
        failure.text);
    TEST_ASSERT_TRUE(model_parameter(&model.block[0], "beta_s")->value[0] == 1e-3);
    TEST_ASSERT_TRUE(model_parameter(&model.block[0], "rate_filter_s")->value[0] == 0.0);
    TEST_ASSERT_TRUE(isinf(model_parameter(&model.block[0], "limit_v")->value[0]));
    model_free(&model);
}

#define BLOCK(name, parameters) "{\"block\":\"" name "\",\"parameters\":{" parameters "}}"
#define BANK(weights, thresholds)                                                                                      \
    BLOCK("prandtl_ishlinskii", "\"offset_um\":0,\"weights\":" weights ",\"thresholds_v\":" thresholds)
#define MODEL(chain) "{\"format\":\"hyst-model-1\",\"sample_rate_hz\":100,\"chain\":[" chain "]}"
#define GOOD_BANK    BANK("[1,1]", "[1]")

static const struct {
    const char *text, *line;
} bad_models[] = {
    {"", "test_model.json: empty"},
    {"{", "test_model.json:1:"},
    {"\x01\x02", "test_model.json: not a model, which is JSON"},
    {"[]", "\"format\" must be"},
    {"{\"format\":\"hyst-model-2\"}", "\"format\" must be \"hyst-model-1\""},
    {"{\"format\":\"hyst-model-1\",\"chain\":[]}", "\"sample_rate_hz\" must be a number"},
    {"{\"format\":\"hyst-model-1\",\"sample_rate_hz\":0,\"chain\":[" GOOD_BANK "]}", "is not a positive number"},
    {"{\"format\":\"hyst-model-1\",\"sample_rate_hz\":1}", "\"chain\" must be an array"},
    {"{\"format\":\"hyst-model-1\",\"sample_rate_hz\":1,\"chain\":[" GOOD_BANK "],\"fit\":3}",
     "\"fit\" must be an object"},
    {"{\"format\":\"hyst-model-1\",\"sample_rate_hz\":1,\"chain\":[" GOOD_BANK "],\"chain2\":3}",
     "unknown key \"chain2\""},
    {"{\"format\":\"hyst-model-1\",\"format\":\"hyst-model-1\"}", "duplicate"},
    {MODEL(""), "exactly one hysteresis block, this one has 0"},
    {MODEL(GOOD_BANK "," GOOD_BANK), "exactly one hysteresis block, this one has 2"},
    {MODEL("3"), "chain[0]: needs a string \"block\""},
    {MODEL(GOOD_BANK ",{\"block\":\"magic\",\"parameters\":{}}"), "chain[1]: unknown block \"magic\""},
    {MODEL("{\"block\":\"resonance\"}"), "chain[0]: block resonance: needs an object \"parameters\""},
    {MODEL("{\"block\":\"resonance\",\"parameters\":{},\"more\":1}"), "block resonance: unknown key \"more\""},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":1")), "block resonance: missing parameter \"damping_ratio\""},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":1,\"damping_ratio\":0.1,\"q\":1")), "unknown parameter \"q\""},
    {MODEL(GOOD_BANK "," BLOCK("resonance", "\"frequency_hz\":-1,\"damping_ratio\":0.1")),
     "frequency_hz = -1 Hz is outside"},
    {MODEL(GOOD_BANK "," BLOCK("resonance", "\"frequency_hz\":1,\"damping_ratio\":1.5")),
     "damping_ratio = 1.5 is outside"},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":\"fast\",\"damping_ratio\":0.1")),
     "parameter frequency_hz: value must be a number"},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":[1],\"damping_ratio\":0.1")),
     "parameter frequency_hz: value must be a number"},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":{\"sigma\":1},\"damping_ratio\":0.1")),
     "parameter frequency_hz: no \"value\""},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":{\"value\":1,\"unit\":\"kHz\"},\"damping_ratio\":0.1")),
     "unit must be \"Hz\""},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":{\"value\":1,\"error\":1},\"damping_ratio\":0.1")),
     "unknown key \"error\""},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":{\"value\":1,\"sigma\":-1},\"damping_ratio\":0.1")),
     "sigma = -1 is negative"},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":{\"value\":null},\"damping_ratio\":0.1")), "value must be a number"},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":{\"value\":1,\"determined\":0},\"damping_ratio\":0.1")),
     "determined must be true, false or an array"},
    {MODEL(BANK("1", "[1]")), "parameter weights: value must be an array"},
    {MODEL(BANK("[1,\"x\"]", "[1]")), "parameter weights: value[1] is not a number"},
    {MODEL(BANK("[1,2,3]", "[1]")), "3 weights for 1 thresholds"},
    {MODEL(BANK("[1,2,3]", "[2,1]")), "thresholds_v[1] does not rise"},
    {MODEL(BANK("[1,2]", "[0]")), "thresholds_v[0] = 0 V is outside"},
    {MODEL(BANK("[1,2]", "[-1]")), "thresholds_v[0] = -1 V is outside"},
    {MODEL(BANK("[1,1e999]", "[1]")), "test_model.json:1:"},
    {MODEL(BANK("[1,NaN]", "[1]")), "test_model.json:1:"},
    {MODEL(BANK("{\"value\":[1,2],\"sigma\":[1]}", "[1]")), "sigma has 1 elements, value has 2"},
    {MODEL(BLOCK("rate_dependent_hysteresis", "\"beta_s\":1e-3,\"immediate\":0.5") "," GOOD_BANK),
     "immediate = 0.5 is neither 0 nor 1"},
    {MODEL(BLOCK("rate_dependent_hysteresis", "\"beta_s\":1e-3") "," BLOCK(
         "stop_prandtl_ishlinskii", "\"offset_v\":0,\"weights\":[1],\"thresholds_um\":[]")),
     "block rate_dependent_hysteresis widens plays or relays, and stop_prandtl_ishlinskii has none"},
    {MODEL(BLOCK("resonance", "\"frequency_hz\":1,\"damping_ratio\":0.1") "," GOOD_BANK),
     "stands behind a block of mechanics"},
};

static void test_refuses_broken_models(void) {
    for (size_t i = 0; i < sizeof bad_models / sizeof bad_models[0]; i++) {
        model_t model;
        failure_t failure = {{0}};
        TEST_ASSERT_FALSE_MESSAGE(read_text(&model, bad_models[i].text, &failure), bad_models[i].line);
        expect_line(&failure, bad_models[i].line);
        expect_line(&failure, file);
    }
}

static void test_refuses_too_many_blocks(void) {
    char text[4000];
    size_t length = (size_t)snprintf(text, sizeof text, "%s",
                                     "{\"format\":\"hyst-model-1\",\"sample_rate_hz\":1,\"chain\":[" GOOD_BANK);
    model_t model;
    failure_t failure;
    for (int i = 0; i < MODEL_MAX_BLOCKS; i++) {
        length +=
            (size_t)snprintf(text + length, sizeof text - length, "%s", "," BLOCK("quantisation", "\"step_um\":1"));
    }
    snprintf(text + length, sizeof text - length, "]}");
    TEST_ASSERT_FALSE(read_text(&model, text, &failure));
    expect_line(&failure, "chain has 33 blocks");
}

static void test_a_missing_file_is_named(void) {
    model_t model;
    failure_t failure;
    TEST_ASSERT_FALSE(model_read(&model, "no_such_model.json", &failure));
    expect_line(&failure, "no_such_model.json");
}

/* The catalogue's own promises, on which the model reader relies. */
/* The numbers of a block that has moved up into a gap are its own. */
static void test_a_block_appended_after_another_went_has_its_own_numbers(void) {
    model_t model;
    model_create(&model, 1000.0);
    model_append(&model, &block_transport_delay);
    model_set(model_append(&model, &block_amplifier_bandwidth), "cutoff_hz", 50.0);
    model_remove(&model, 0);
    model_set(model_append(&model, &block_sensor_bandwidth), "cutoff_hz", 70.0);
    TEST_ASSERT_EQUAL_UINT64(2, model.blocks);
    TEST_ASSERT_TRUE(model.block[0].parameter[0].value != model.block[1].parameter[0].value);
    TEST_ASSERT_EQUAL_DOUBLE(50.0, model.block[0].parameter[0].value[0]);
    TEST_ASSERT_EQUAL_DOUBLE(70.0, model.block[1].parameter[0].value[0]);
    model_free(&model);
}

static void test_every_block_of_the_catalogue_is_complete(void) {
    TEST_ASSERT_NULL(catalogue_find("magic"));
    for (size_t i = 0; i < catalogue_count; i++) {
        const block_t *block = catalogue[i];
        TEST_ASSERT_EQUAL_PTR(block, catalogue_find(block->name));
        TEST_ASSERT_TRUE(block->parameters <= BLOCK_MAX_PARAMETERS);
        TEST_ASSERT_TRUE(block->text != NULL && (block->state_bytes > 0 || block->further_bytes != NULL) &&
                         block->open != NULL && block->settle != NULL && block->step != NULL);
        for (size_t p = 0; p < block->parameters; p++) {
            TEST_ASSERT_TRUE(block->parameter[p].low < block->parameter[p].high);
            TEST_ASSERT_TRUE(block->parameter[p].unit != NULL && block->parameter[p].text != NULL);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_write_then_read_gives_the_same_model);
    RUN_TEST(test_says_what_is_not_determined);
    RUN_TEST(test_reads_bare_values_and_defaults);
    RUN_TEST(test_refuses_broken_models);
    RUN_TEST(test_refuses_too_many_blocks);
    RUN_TEST(test_a_missing_file_is_named);
    RUN_TEST(test_a_block_appended_after_another_went_has_its_own_numbers);
    RUN_TEST(test_every_block_of_the_catalogue_is_complete);
    return UNITY_END();
}
