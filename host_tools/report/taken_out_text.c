/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "report/taken_out_text.h"
#include "base/json_output.h"
#include "base/quantity.h"
#include "base/shown_name.h"
#include <math.h>

bool taken_out_text(const account_t *account, const recording_t *recordings, size_t recording,
                    char text[DIAGNOSIS_LINE]) {
    const taken_out_t *taken = &account->taken_out[recording];
    const char *separator = "";
    text[0] = '\0';
    if (taken->past_rms_um > 0.0) {
        text_append(text, "%.2g um rms, %.2g um from end to end, that drives before it may have left",
                    taken->past_rms_um, taken->past_range_um);
        separator = "; ";
    }
    if (taken->offset_um != 0.0) {
        text_append(text, "%s%+.3g um, its zero beside that of the first recording", separator, taken->offset_um);
        separator = "; ";
    }
    if (taken->left_out_s > 0.0) {
        text_append(text, "%sits first %.3g s, where the model is %.2g um rms off, are not counted", separator,
                    taken->left_out_s, taken->left_out_rms_um);
    }
    if (text[0] != '\0') {
        text_append(text, " (%s)", without_folder(recordings[recording].name));
    }
    return text[0] != '\0';
}

bool lag_of_one_text(const account_t *account, const recording_t *recordings, size_t recording,
                     char text[DIAGNOSIS_LINE]) {
    const taken_out_t *taken = &account->taken_out[recording];
    text[0] = '\0';
    if (taken_out_lags(taken, account->recordings)) {
        char lag[QUANTITY_TEXT];
        quantity_text(lag, "", "s", fabs(taken->lag_s), taken->lag_sigma_s);
        text_append(
            text,
            "%s is %s %s than the one model of all these recordings: another filter or rate, or the file is not "
            "what its name says",
            without_folder(recordings[recording].name), lag, taken->lag_s > 0.0 ? "later" : "earlier");
    }
    return text[0] != '\0';
}

json_t *taken_out_to_json(const account_t *account, const recording_t *recordings) {
    json_t *list = json_array();
    for (size_t i = 0; i < account->recordings; i++) {
        const taken_out_t *taken = &account->taken_out[i];
        const char *name = recordings[i].name;
        if (taken->past_rms_um > 0.0) {
            json_array_append_new(list, json_pack("{s:s, s:s, s:f, s:f}", "what", "past", "recording", name, "rms_um",
                                                  taken->past_rms_um, "range_um", taken->past_range_um));
        }
        if (taken->offset_um != 0.0) {
            json_array_append_new(list, json_pack("{s:s, s:s, s:f, s:f}", "what", "offset", "recording", name, "rms_um",
                                                  fabs(taken->offset_um), "offset_um", taken->offset_um));
        }
        if (taken->left_out_s > 0.0) {
            json_array_append_new(list, json_pack("{s:s, s:s, s:f, s:f}", "what", "beginning", "recording", name,
                                                  "rms_um", taken->left_out_rms_um, "duration_s", taken->left_out_s));
        }
    }
    return list;
}

json_t *each_to_json(const account_t *account, const recording_t *recordings) {
    if (account->recordings < 2) {
        return NULL;
    }
    json_t *list = json_array();
    for (size_t i = 0; i < account->recordings; i++) {
        const taken_out_t *taken = &account->taken_out[i];
        json_array_append_new(list, json_pack("{s:s, s:f, s:o, s:o, s:b}", "recording", recordings[i].name, "offset_um",
                                              taken->offset_um, "lag_s", json_number_or_null(taken->lag_s),
                                              "lag_sigma_s", json_number_or_null(taken->lag_sigma_s), "lags",
                                              (int)taken_out_lags(taken, account->recordings)));
    }
    return list;
}
