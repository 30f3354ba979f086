# SPDX-License-Identifier: MIT
# Link hyst_warnings PRIVATE into every target written here: warnings are errors.
add_library(hyst_warnings INTERFACE)
target_compile_options(hyst_warnings INTERFACE
  -Wall -Wextra -Werror -Wconversion -Wsign-conversion -Wdouble-promotion
  -Wshadow -Wundef -Wstrict-prototypes -Wmissing-prototypes -Wvla)
