/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Error handling of GSL. */
#ifndef GSL_ERRORS_H
#define GSL_ERRORS_H

/** Makes GSL return error codes from now on instead of aborting the program. Its error handler is shared by all
 * threads, so it is set once and never restored. */
void gsl_returns_errors(void);

#endif
