/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What GSL does when it cannot do what it was asked for. */
#ifndef GSL_ERRORS_H
#define GSL_ERRORS_H

/** From here on it returns an error code instead of ending the program. Its handler is one for all threads, so it is
 * set once and stays. */
void gsl_returns_errors(void);

#endif
