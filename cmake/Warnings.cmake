# SPDX-License-Identifier: MIT
# Link hyst_warnings PRIVATE into every target written here: warnings are errors, but where pip builds, with a compiler
# that may know new ones.
add_library(hyst_warnings INTERFACE)
target_compile_options(hyst_warnings INTERFACE
  -Wall -Wextra $<$<NOT:$<BOOL:${SKBUILD}>>:-Werror> -Wconversion -Wsign-conversion -Wdouble-promotion
  -Wshadow -Wundef -Wstrict-prototypes -Wmissing-prototypes -Wvla)
