/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "baseline.h"
#include "fit.h"

/* Play operators, and levels of a Preisach plane less one: enough for the shape, few enough to be fitted again often.
 */
static const struct {
    const char *family;
    size_t operators;
} shapes[] = {{"prandtl_ishlinskii", 24}, {"bouc_wen", 0}, {"preisach", 14}};

size_t baseline_shapes(void) {
    return sizeof shapes / sizeof shapes[0];
}

bool baseline_fit(size_t shape, const recording_t *recordings, size_t count, model_t *baseline, const family_t **family,
                  failure_t *failure) {
    const fit_options_t options = {.operators = shapes[shape].operators};
    fit_report_t report;
    *family = family_find(shapes[shape].family);
    if (!fit_recordings(*family, recordings, count, &options, baseline, &report, failure)) {
        return false;
    }
    fit_report_free(&report);
    return true;
}
