/* SPDX-License-Identifier: GPL-3.0-or-later */
/** What the ending of a file's name says that it is. */
#ifndef FILE_ENDING_H
#define FILE_ENDING_H

/** The one of these endings that a name has, in any case, behind at least one letter; NULL: none. The list ends with
 * NULL. */
const char *file_ending(const char *name, const char *const endings[]);

#endif
