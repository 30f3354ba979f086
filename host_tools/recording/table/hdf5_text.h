/* SPDX-License-Identifier: GPL-3.0-or-later */
/** Texts in HDF5 files, as any program writes them. */
#ifndef HDF5_TEXT_H
#define HDF5_TEXT_H

#include <hdf5.h>

/** Room for a name or a unit. */
enum { HDF5_TEXT = 400 };

/** A text attribute of a data set or group: of fixed or variable length, cut to the room. "" if there is none. */
void hdf5_read_text(hid_t object, const char *name, char *text, size_t room);

/** The texts of an attribute, one behind each other in `room` bytes each. Returns how many; 0: none, or more than
 * `most`.
 */
size_t hdf5_read_texts(hid_t object, const char *name, char *text, size_t room, size_t most);

#endif
