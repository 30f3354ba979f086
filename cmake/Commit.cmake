# SPDX-License-Identifier: MIT
# cmake -DSOURCE=folder -DOUTPUT=built_from.c -P Commit.cmake
#
# Writes `const char built_from[]`: the commit of the source folder, with "-dirty" where it was changed since, and
# "unknown" where git knows none. What is already written and right is not written again.
set(commit unknown)
find_program(GIT git)
if(GIT)
  # git would name the repository of a folder above, which an unpacked archive may be in.
  execute_process(COMMAND ${GIT} -C ${SOURCE} rev-parse --show-cdup OUTPUT_VARIABLE above RESULT_VARIABLE failed
                  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(NOT failed AND above STREQUAL "")
    execute_process(COMMAND ${GIT} --no-optional-locks -C ${SOURCE} describe --always --dirty --exclude=* --abbrev=12
                    OUTPUT_VARIABLE described RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(NOT failed)
      set(commit ${described})
    endif()
  endif()
endif()
file(WRITE ${OUTPUT}.new "/* Written by cmake/Commit.cmake. */
#include \"built_from.h\"
const char built_from[] = \"${commit}\";
")
file(COPY_FILE ${OUTPUT}.new ${OUTPUT} ONLY_IF_DIFFERENT)
