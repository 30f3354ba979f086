/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The classical model in stop form: the drive as a weighted sum of stops of the position. */
#include "catalogue.h"
#include "stop_fit.h"

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return stop_family_fit(job, &block_stop_prandtl_ishlinskii, false, model, notes, failure);
}

const family_t family_stop_prandtl_ishlinskii = {
    .name = "stop_prandtl_ishlinskii",
    .text = "Prandtl-Ishlinskii in stop form, four stops: least error of the drive at the recorded position",
    .fit = fit};
