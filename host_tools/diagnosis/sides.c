/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "sides.h"
#include "catalogue.h"
#include "findings.h"
#include "golden_section.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Parts of a change. Numbers from the position are right to some percent: more is all, less is nothing. */
static const double nearly_all = 0.85, hardly_any = 0.08, deviations = 3.0;
/* As in the search: 2 log likelihood that makes a name, pays for a number, and has to come from held-out samples. */
static const double margin_of_a_name = 20.0, number_price = 10.0, support_at_least = 12.0;
enum { ITERATIONS = 16, CUTOFF_STEPS = 24 };
/* How far from its cutoff in the position the one in the column may be. */
static const double cutoff_range = 8.0;

const block_t *sides_block(const block_t *block) {
    return block == &block_sensor_bandwidth    ? &block_amplifier_bandwidth
           : block->place == PLACE_ELECTRONICS ? block
                                               : NULL;
}

/* A low pass at its place: the amplifier's first, the sensor's last. */
static void add_low_pass(model_t *model, const block_t *block, double cutoff_hz) {
    model_set(model_append(model, block), "cutoff_hz", cutoff_hz);
    if (block == &block_amplifier_bandwidth) {
        const model_block_t added = model->block[model->blocks - 1];
        memmove(&model->block[1], &model->block[0], (model->blocks - 1) * sizeof model->block[0]);
        model->block[0] = added;
    }
}

static double cutoff_of(const diagnosis_t *d, const finding_t *finding) {
    return model_parameter(&d->model.block[finding_index(d, finding)], "cutoff_hz")->value[0];
}

static void without_finding(const diagnosis_t *d, const finding_t *finding, model_t *without) {
    model_copy(without, &d->model);
    model_remove(without, finding_index(d, finding));
}

electrical_change_t sides_change(const diagnosis_t *d, const finding_t *finding, column_t column) {
    electrical_change_t change = {0};
    const block_t *block = sides_block(finding->block);
    if (block != NULL && column_measured(&d->samples, column)) {
        model_t without, with;
        without_finding(d, finding, &without);
        model_copy(&with, block == finding->block ? &d->model : &without);
        if (block != finding->block) {
            add_low_pass(&with, block, cutoff_of(d, finding));
        }
        change = electrical_change(&d->samples, column, &without, &with);
        model_free(&without);
        model_free(&with);
    }
    return change;
}

bool sides_only_part(const electrical_change_t *change) {
    return change->part + deviations * change->sigma < nearly_all;
}

/* By the voltage, or by the current without it. */
static electrical_change_t change_of(const diagnosis_t *d, const finding_t *finding) {
    const electrical_change_t voltage = sides_change(d, finding, COLUMN_VOLTAGE);
    return voltage.measured ? voltage : sides_change(d, finding, COLUMN_CURRENT);
}

static const block_t *other_side(const block_t *block) {
    return block == &block_amplifier_bandwidth ? &block_sensor_bandwidth
           : block == &block_sensor_bandwidth  ? &block_amplifier_bandwidth
                                               : NULL;
}

/* 2 log likelihood that the columns give the electronics of a model, compared with the baseline's. */
static double by_columns(const diagnosis_t *d, const model_t *model) {
    return electrical_likelihood(&d->samples, &d->baseline, model, &block_amplifier_bandwidth);
}

/* How much a proposal is preferred to the model, as 2 log likelihood. */
typedef struct {
    double position; /* by all samples of the position; by the held-out ones among them */
    double held_out;
    double columns;
} preference_t;

/* Fits the proposal except for some blocks (bits). */
static bool weigh(attempt_t *job, model_t *proposal, unsigned held_fast, joint_power_t *power,
                  preference_t *preference) {
    const diagnosis_t *d = job->diagnosis;
    const unsigned free_blocks = attempt_blocks_found(d, proposal) & ~held_fast;
    if (!joint_fit(&d->samples, &d->noise, proposal, free_blocks, ITERATIONS, power, job->failure)) {
        return false;
    }
    preference->held_out = (double)d->samples.held * log(job->power.held / power->held);
    preference->position = (double)d->samples.fitted * log(job->power.fitted / power->fitted) + preference->held_out;
    preference->columns = by_columns(d, proposal) - by_columns(d, &d->model);
    return true;
}

static void keep(attempt_t *job, model_t *proposal, const joint_power_t *power) {
    model_free(&job->diagnosis->model);
    job->diagnosis->model = *proposal;
    job->power = *power;
}

/* In the list of what was considered, last round first. */
static void note_taken(diagnosis_t *d, const block_t *block) {
    for (size_t c = d->considered; c-- > 0;) {
        if (d->consideration[c].block == block) {
            d->consideration[c].outcome = TAKEN;
            return;
        }
    }
}

/* The finding is of the other block. */
static void rename_finding(diagnosis_t *d, finding_t *finding, const block_t *block, double margin) {
    for (size_t c = 0; c < d->considered; c++) {
        considered_t *considered = &d->consideration[c];
        if (considered->block == finding->block && considered->outcome == TAKEN) {
            considered->outcome = CONTRADICTED;
        }
    }
    note_taken(d, block);
    finding->block = block;
    finding->certainty = NAMED;
    finding->rivals = 0;
    finding->margin = margin;
}

static bool swap(attempt_t *job, finding_t *finding) {
    diagnosis_t *d = job->diagnosis;
    const block_t *block = other_side(finding->block);
    model_t proposal;
    joint_power_t power;
    preference_t preference;
    without_finding(d, finding, &proposal);
    add_low_pass(&proposal, block, cutoff_of(d, finding));
    const bool good = weigh(job, &proposal, 0, &power, &preference);
    if (good && preference.position + preference.columns > margin_of_a_name) {
        rename_finding(d, finding, block, preference.position + preference.columns);
        keep(job, &proposal, &power);
    } else {
        model_free(&proposal);
    }
    return good;
}

/* The finding that stands for the second low pass: what it explains of what the chain leaves without it. */
static bool describe(attempt_t *job, const model_t *proposal, finding_t *added) {
    const diagnosis_t *d = job->diagnosis;
    double ignored;
    evidence_t *evidence = evidence_open(&d->model, &d->samples, &d->noise, job->failure);
    if (evidence == NULL) {
        return false;
    }
    double *change = samples_column(&d->samples), *before = samples_column(&d->samples);
    bool good = samples_simulate(&d->samples, &d->model, before, job->failure) &&
                samples_simulate(&d->samples, proposal, change, job->failure) &&
                attempt_measure(job, &d->model, &ignored, &added->held_out_before_percent) &&
                attempt_measure(job, proposal, &ignored, &added->held_out_after_percent);
    for (size_t k = 0; good && k < d->samples.all; k++) {
        change[k] -= before[k];
    }
    const evidence_test_t test = evidence_test(evidence, change);
    added->t = test.t;
    added->t_blocks = test.t_blocks;
    free(change);
    free(before);
    evidence_close(evidence);
    return good;
}

typedef struct {
    const samples_t *samples;
    model_t *model;
    size_t at; /* of the amplifier's low pass */
} cutoff_search_t;

static bool left_by_cutoff(void *context, double log_hz, double *left) {
    const cutoff_search_t *search = context;
    model_set(&search->model->block[search->at], "cutoff_hz", exp(log_hz));
    *left = electrical_left(search->samples, COLUMN_VOLTAGE, search->model);
    return true;
}

/* The amplifier's cutoff as the voltage has it. Returns the block, as a bit. */
static unsigned set_by_voltage(const diagnosis_t *d, model_t *model) {
    cutoff_search_t search = {&d->samples, model, 0};
    while (model->block[search.at].block != &block_amplifier_bandwidth) {
        search.at++;
    }
    const double now = log(model_parameter(&model->block[search.at], "cutoff_hz")->value[0]);
    double log_hz = now;
    golden_section(left_by_cutoff, &search, now - log(cutoff_range), now + log(cutoff_range), CUTOFF_STEPS, &log_hz);
    model_set(&model->block[search.at], "cutoff_hz", exp(log_hz));
    return 1U << search.at;
}

/* Takes out what stood in for the second low pass, and now would not be large enough beside the two. */
static bool tidy(attempt_t *job, unsigned low_passes) {
    diagnosis_t *d = job->diagnosis;
    model_t again;
    joint_power_t power;
    preference_t ignored;
    if (!attempt_reconsider(job, attempt_least_part_of_found * job->found_um / d->noise.sigma_um, low_passes)) {
        return false;
    }
    model_copy(&again, &d->model);
    const bool good = weigh(job, &again, set_by_voltage(d, &again), &power, &ignored);
    if (good) {
        keep(job, &again, &power);
    } else {
        model_free(&again);
    }
    return good;
}

/* A lag on either side. That of the amplifier is what the voltage says and stays so: from the position the two can
 * hardly be told apart. The sensor's begins with the rest of the lag. */
static bool split(attempt_t *job, finding_t *finding, double part_before) {
    diagnosis_t *d = job->diagnosis;
    const double cutoff_hz = cutoff_of(d, finding);
    finding_t added = {.block = other_side(finding->block), .certainty = NAMED};
    model_t proposal;
    joint_power_t power;
    preference_t preference;
    without_finding(d, finding, &proposal);
    add_low_pass(&proposal, &block_amplifier_bandwidth, cutoff_hz);
    add_low_pass(&proposal, &block_sensor_bandwidth, cutoff_hz / (1.0 - part_before));
    bool good = weigh(job, &proposal, set_by_voltage(d, &proposal), &power, &preference);
    if (good && preference.held_out > support_at_least && preference.position > margin_of_a_name + number_price &&
        preference.columns > 0.0) {
        const unsigned low_passes = 1U << (finding - d->finding) | 1U << d->findings;
        added.support = preference.held_out;
        added.margin = preference.position + preference.columns;
        good = describe(job, &proposal, &added);
        keep(job, &proposal, &power);
        d->finding[d->findings++] = added;
        note_taken(d, added.block);
        good = good && tidy(job, low_passes);
    } else {
        model_free(&proposal);
    }
    return good;
}

/* Whether the voltage shows some of a low pass, but not all. */
static bool shows_a_part(const electrical_change_t *change) {
    return change->measured && change->part - deviations * change->sigma > hardly_any && sides_only_part(change);
}

static bool settle(attempt_t *job, finding_t *finding) {
    diagnosis_t *d = job->diagnosis;
    const bool before = finding->block == &block_amplifier_bandwidth;
    const electrical_change_t change = change_of(d, finding), voltage = sides_change(d, finding, COLUMN_VOLTAGE);
    const change_verdict_t verdict = electrical_verdict(&change);
    if (shows_a_part(&voltage) && d->findings < DIAGNOSIS_MOST_FINDINGS) {
        const size_t findings = d->findings;
        if (!split(job, finding, voltage.part)) {
            return false;
        }
        if (d->findings > findings) {
            return true;
        }
    }
    return verdict != (before ? CHANGE_ABSENT : CHANGE_PRESENT) || (!before && sides_only_part(&change)) ||
           swap(job, finding);
}

bool sides_settle(attempt_t *job) {
    diagnosis_t *d = job->diagnosis;
    bool good = true;
    for (size_t f = 0; good && f < d->findings; f++) {
        const block_t *other = other_side(d->finding[f].block);
        if (other != NULL && model_find(&d->model, other->name) == NULL) {
            good = settle(job, &d->finding[f]);
        }
    }
    return good;
}
