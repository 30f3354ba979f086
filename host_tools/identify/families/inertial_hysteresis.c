/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The stop form with inertia and damping. */
#include "chain/catalogue.h"
#include "identify/stop_fit.h"

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return stop_family_fit(job, &block_inertial_hysteresis, true, model, notes, failure);
}

const family_t family_inertial_hysteresis = {
    .name = "inertial_hysteresis",
    .order = 60,
    .text = "a mass on a damper and a spring of stops; takes recordings at several frequencies, and preloads",
    .fit = fit,
    .without = &family_stop_prandtl_ishlinskii};
