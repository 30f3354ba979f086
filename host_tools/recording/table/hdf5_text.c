/* SPDX-License-Identifier: GPL-3.0-or-later */
#define H5_USE_110_API /* the interface that Debian 12 has; later ones keep it */
#include "recording/table/hdf5_text.h"
#include <string.h>

void hdf5_read_text(hid_t object, const char *name, char *text, size_t room) {
    hid_t attribute, type, space;
    text[0] = '\0';
    if (H5Aexists(object, name) <= 0) {
        return;
    }
    attribute = H5Aopen(object, name, H5P_DEFAULT);
    type = H5Aget_type(attribute);
    space = H5Aget_space(attribute);
    if (H5Tget_class(type) == H5T_STRING && H5Sget_simple_extent_npoints(space) == 1) {
        hid_t memory = H5Tcopy(H5T_C_S1);
        H5Tset_cset(memory, H5Tget_cset(type));
        if (H5Tis_variable_str(type) > 0) {
            char *pointer = NULL;
            H5Tset_size(memory, H5T_VARIABLE);
            if (H5Aread(attribute, memory, (void *)&pointer) >= 0 && pointer != NULL) {
                strncat(text, pointer, room - 1);
                H5free_memory(pointer);
            }
        } else {
            H5Tset_size(memory, room);
            if (H5Aread(attribute, memory, text) < 0) {
                text[0] = '\0';
            }
            text[room - 1] = '\0';
        }
        H5Tclose(memory);
    }
    H5Sclose(space);
    H5Tclose(type);
    H5Aclose(attribute);
}
