/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "numerics/gsl_errors.h"
#include <gsl/gsl_errno.h>
#include <pthread.h>

static void set_handler(void) {
    gsl_set_error_handler_off();
}

void gsl_returns_errors(void) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, set_handler);
}
