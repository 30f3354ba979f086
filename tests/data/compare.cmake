# SPDX-License-Identifier: MIT
execute_process(COMMAND ${GENERATOR} OUTPUT_FILE ${WRITTEN} COMMAND_ERROR_IS_FATAL ANY)
if(WRAP)
  execute_process(COMMAND ${WRAP} --written ${WRITTEN} COMMAND_ERROR_IS_FATAL ANY)
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files ${WRITTEN} ${COMMITTED} RESULT_VARIABLE different)
if(different)
  message(FATAL_ERROR "${COMMITTED} is not what its generator writes (${WRITTEN})")
endif()
