/* SPDX-License-Identifier: MIT */
/**
 * The commit that the program was built from: beside the seed, what a replay of a random test needs. It ends in
 * "-dirty" where the sources were changed since, and is "unknown" outside of git.
 */
#ifndef TESTS_BUILT_FROM_H
#define TESTS_BUILT_FROM_H

extern const char built_from[];

#endif
