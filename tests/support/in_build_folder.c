/* SPDX-License-Identifier: MIT */
/*
 * Part of every test (hyst_test). Moves to the test's folder in the build tree before main, as ctest does: so what a
 * test writes is there also when it is run by hand from elsewhere.
 */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

__attribute__((constructor)) static void enter(void) {
    if (chdir(HYST_TEST_FOLDER) != 0) {
        perror(HYST_TEST_FOLDER);
        exit(EXIT_FAILURE);
    }
}
