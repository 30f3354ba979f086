# SPDX-License-Identifier: MIT
# Toolchain file: Cortex-M4F, hard float ABI. lib/hyst and the application use no floating point.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_ASM_COMPILER arm-none-eabi-gcc)
set(CMAKE_AR arm-none-eabi-gcc-ar) # these know what -flto leaves in an object
set(CMAKE_RANLIB arm-none-eabi-gcc-ranlib)
set(CMAKE_OBJCOPY arm-none-eabi-objcopy)
set(CMAKE_SIZE arm-none-eabi-size)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffunction-sections -fdata-sections")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,--gc-sections")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
# The core takes instructions one by one, in order: moving them apart, before registers are handed out (schedule-insns,
# tree-pre) or after (schedule-insns2), earns it nothing, and costs what has to be put on the stack. Compiled as a whole
# (flto), a sample has no calls where something is called from one place alone. docs/TIMING.md.
add_compile_options(-fno-schedule-insns -fno-schedule-insns2 -fno-tree-pre -flto)
add_link_options(-flto -flto-partition=one)
