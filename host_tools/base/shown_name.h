/* SPDX-License-Identifier: GPL-3.0-or-later */
/** How people see a file: without its folders, and a standard stream by its name. */
#ifndef SHOWN_NAME_H
#define SHOWN_NAME_H

#include <stddef.h>

/** From now on this path is shown as that. Both must outlive the process's last message; a few paths at most. */
void shown_name_set(const char *path, const char *shown);
/** What to print of a path: itself, unless it was set. */
const char *shown_name(const char *path);
/** The part of a path behind its folders. */
const char *without_folder(const char *path);
/** Puts what is shown in place of such paths in a message. */
void shown_names_put_in(char *text, size_t room);

#endif
