/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "diagnosis/answer/answer.h"
#include "diagnosis/evidence/searched.h"
#include <math.h>
#include <stdlib.h>

/* Below this number of reversals of at least this travel no loop occurs twice. The shortest recordings of the proof
 * have eight. Cut to two or fewer, one in four of them yields a finding that is not there. */
static const double large_way = 0.5;
static const size_t fewest_reversals = 3;

size_t answer_reversals(const answer_t *answer) {
    return samples_reversals(&answer->question->samples, large_way);
}

bool answer_has_too_little(const answer_t *answer) {
    return answer_reversals(answer) < fewest_reversals;
}

bool answer_rests_on_past(const answer_t *answer) {
    return answer->past_percent > fmax(answer->nrmse_percent, answer->held_out_percent);
}

bool answer_has_heard(const answer_t *answer) {
    for (size_t f = 0; f < answer->findings; f++) {
        if (answer->finding[f].heard) {
            return true;
        }
    }
    return false;
}

bool finding_is_empirical(const finding_t *finding) {
    return finding->block->empirical != NULL;
}

size_t findings_named(const answer_t *answer) {
    size_t named = 0;
    while (named < answer->findings && !finding_is_empirical(&answer->finding[named])) {
        named++;
    }
    return named;
}

double findings_named_held_out_percent(const answer_t *answer) {
    const size_t named = findings_named(answer);
    return named < answer->findings ? answer->finding[named].held_out_before_percent : answer->held_out_percent;
}

bool number_is_told(const model_block_t *block, size_t parameter) {
    const parameter_info_t *info = &block->block->parameter[parameter];
    return number_is_searched(block, parameter) || info->center_of != NULL || info->half_of != NULL ||
           (block->block->empirical != NULL && info->chosen);
}

const finding_t *finding_of(const answer_t *answer, const block_t *block) {
    for (size_t f = 0; f < answer->findings; f++) {
        if (answer->finding[f].block == block) {
            return &answer->finding[f];
        }
    }
    return NULL;
}

bool finding_may_be(const answer_t *answer, const block_t *block) {
    for (size_t f = 0; f < answer->findings; f++) {
        if (finding_has_rival(&answer->finding[f], block)) {
            return true;
        }
    }
    return finding_of(answer, block) != NULL;
}

size_t finding_index(const answer_t *answer, const finding_t *finding) {
    size_t index = 0;
    while (answer->model.block[index].block != finding->block) {
        index++;
    }
    return index;
}

void finding_left_out(const answer_t *answer, const finding_t *finding, model_t *without) {
    model_copy(without, &answer->model);
    model_remove(without, finding_index(answer, finding));
}

bool finding_has_rival(const finding_t *finding, const block_t *rival) {
    for (size_t r = 0; r < finding->rivals; r++) {
        if (finding->rival[r] == rival) {
            return true;
        }
    }
    return false;
}

bool refitted_changed(const model_block_t *given, const model_block_t *fitted, size_t parameter) {
    const parameter_t *was = &given->parameter[parameter], *is = &fitted->parameter[parameter];
    return number_is_searched(fitted, parameter) && is->sigma != NULL &&
           fabs(is->value[0] - was->value[0]) > 2.0 * is->sigma[0];
}

void answer_free_models(answer_t *answer) {
    model_free(&answer->given);
    model_free(&answer->baseline);
    model_free(&answer->model);
}

void answer_free(answer_t *answer) {
    question_free(answer->question);
    answer->question = NULL;
    answer_free_models(answer);
}

bool finding_times(const answer_t *answer, const finding_t *finding, double time_s[2]) {
    const probe_t *probe = finding->block->probe;
    if (probe == NULL || probe->times.from_s == NULL) {
        return false;
    }
    const samples_t *samples = &answer->question->samples;
    const model_block_t *block = &answer->model.block[finding_index(answer, finding)];
    const double fastest_s = 2.0 / samples_fastest_hz(samples);
    time_s[0] = fmax(fastest_s, *model_parameter(block, probe->times.from_s)->value);
    time_s[1] = fmin(samples_longest_s(samples), *model_parameter(block, probe->times.to_s)->value);
    return time_s[0] < time_s[1];
}
