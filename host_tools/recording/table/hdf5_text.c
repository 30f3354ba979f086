/* SPDX-License-Identifier: GPL-3.0-or-later */
#define H5_USE_110_API /* the interface that Debian 12 has; later ones keep it */
#include "recording/table/hdf5_text.h"
#include "base/failure.h"
#include <stdlib.h>
#include <string.h>

/* Texts that HDF5 allocates one by one. */
static bool read_variable(hid_t attribute, hid_t memory, size_t count, char *text, size_t room) {
    char **const pointer = allocate(count, sizeof *pointer);
    H5Tset_size(memory, H5T_VARIABLE);
    const bool good = H5Aread(attribute, memory, (void *)pointer) >= 0;
    for (size_t i = 0; good && i < count; i++) {
        text[i * room] = '\0';
        if (pointer[i] != NULL) {
            strncat(text + i * room, pointer[i], room - 1);
            H5free_memory(pointer[i]);
        }
    }
    free((void *)pointer);
    return good;
}

size_t hdf5_read_texts(hid_t object, const char *name, char *text, size_t room, size_t most) {
    size_t count = 0;
    if (H5Aexists(object, name) <= 0) {
        return 0;
    }
    const hid_t attribute = H5Aopen(object, name, H5P_DEFAULT), type = H5Aget_type(attribute),
                space = H5Aget_space(attribute), memory = H5Tcopy(H5T_C_S1);
    const hssize_t there = H5Sget_simple_extent_npoints(space);
    if (H5Tget_class(type) == H5T_STRING && there > 0 && (size_t)there <= most) {
        bool good;
        H5Tset_cset(memory, H5Tget_cset(type));
        if (H5Tis_variable_str(type) > 0) {
            good = read_variable(attribute, memory, (size_t)there, text, room);
        } else {
            H5Tset_size(memory, room);
            good = H5Aread(attribute, memory, text) >= 0;
        }
        count = good ? (size_t)there : 0;
        for (size_t i = 0; i < count; i++) {
            text[(i + 1) * room - 1] = '\0';
        }
    }
    H5Tclose(memory);
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(attribute);
    return count;
}

void hdf5_read_text(hid_t object, const char *name, char *text, size_t room) {
    if (hdf5_read_texts(object, name, text, room, 1) == 0) {
        text[0] = '\0';
    }
}
