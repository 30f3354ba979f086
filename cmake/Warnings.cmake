# SPDX-License-Identifier: MIT
# Link hyst_warnings PRIVATE into every target written here. The presets make warnings errors; a build without a preset
# (pip's, a package's), with a compiler that may know new ones, does not.
add_library(hyst_warnings INTERFACE)
target_compile_options(hyst_warnings INTERFACE
  -Wall -Wextra -Wconversion -Wsign-conversion -Wdouble-promotion
  -Wshadow -Wundef -Wstrict-prototypes -Wmissing-prototypes -Wvla)
