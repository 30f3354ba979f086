/* SPDX-License-Identifier: GPL-3.0-or-later */
/** The compile hook of a block with a bank of stop operators (elements/stop_bank.h). */
#ifndef COMPILE_STOP_BANK_H
#define COMPILE_STOP_BANK_H

#include "compile/compile_job.h"

/** A block's compile hook, without inertia: the inverse as a play bank. */
bool stop_bank_compile(compile_job_t *job, const parameter_t *parameter);

#endif
