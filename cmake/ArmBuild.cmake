# SPDX-License-Identifier: MIT
# The host build also builds every board, so that the emulator tests run what would be flashed.
# HYST_ARM_DIR holds <board>.elf under firmware/, and conformance.elf under tests/conformance/.
find_program(HYST_ARM_GCC arm-none-eabi-gcc)
option(HYST_BUILD_BOARDS "Build the boards with arm-none-eabi-gcc as part of the host build" ON)
set(HYST_ARM_DIR ${CMAKE_BINARY_DIR}/arm)
set(HYST_ARM_BOARDS all)
if(SKBUILD) # pip: what `hyst bench` runs, where it can be built
  set(HYST_ARM_BOARDS bench)
  if(NOT HYST_ARM_GCC)
    message(WARNING "arm-none-eabi-gcc not found: `hyst bench` of this package will need --image")
    set(HYST_BUILD_BOARDS OFF)
  endif()
endif()
if(HYST_BUILD_BOARDS)
  if(NOT HYST_ARM_GCC)
    message(FATAL_ERROR "arm-none-eabi-gcc not found: install gcc-arm-none-eabi, or configure with -DHYST_BUILD_BOARDS=OFF")
  endif()
  include(ExternalProject)
  ExternalProject_Add(boards
    SOURCE_DIR ${CMAKE_SOURCE_DIR}
    BINARY_DIR ${HYST_ARM_DIR}
    CMAKE_ARGS -DCMAKE_TOOLCHAIN_FILE=${CMAKE_SOURCE_DIR}/cmake/arm-none-eabi.cmake
               -DCMAKE_BUILD_TYPE=Release -DHYST_BOARD=${HYST_ARM_BOARDS}
               -DCMAKE_COMPILE_WARNING_AS_ERROR=${CMAKE_COMPILE_WARNING_AS_ERROR}
    BUILD_ALWAYS ON
    INSTALL_COMMAND "")
endif()
