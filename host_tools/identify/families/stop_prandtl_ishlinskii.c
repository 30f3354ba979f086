/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The classical model in stop form: the drive as a weighted sum of stops of the position. */
#include "chain/catalogue.h"
#include "identify/stop_fit.h"

static bool fit(const family_job_t *job, model_t *model, family_notes_t *notes, failure_t *failure) {
    return stop_family_fit(job, &block_stop_prandtl_ishlinskii, false, model, notes, failure);
}

const family_t family_stop_prandtl_ishlinskii = {
    .name = "stop_prandtl_ishlinskii",
    .order = 50,
    .text = "Prandtl-Ishlinskii in stop form, four stops: least error of the drive at the recorded position",
    .fit = fit};
