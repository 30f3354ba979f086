# SPDX-License-Identifier: MIT
execute_process(COMMAND ${GENERATOR} OUTPUT_FILE ${WRITTEN} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${WRITTEN} ${COMMITTED} RESULT_VARIABLE different)
if(different)
  message(FATAL_ERROR "${COMMITTED} is not what its generator writes (${WRITTEN})")
endif()
