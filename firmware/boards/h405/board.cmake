# SPDX-License-Identifier: MIT
board(NAME h405 ID 1 TEXT "h405" CHIP stm32f405 RATES 10000 20000 25000 SOURCES board.c)

if(TARGET h405)
  # `cmake --build build/h405 --target flash`: an ST-LINK on the JTAG connector, through OpenOCD or else st-flash.
  find_program(OPENOCD openocd)
  find_program(ST_FLASH st-flash)
  if(OPENOCD)
    set(flash_command ${OPENOCD} -f interface/stlink.cfg -f target/stm32f4x.cfg -c "program $<TARGET_FILE:h405> verify reset exit")
  elseif(ST_FLASH)
    set(flash_command ${ST_FLASH} --reset write $<TARGET_FILE_DIR:h405>/h405.bin 0x08000000)
  else()
    set(flash_command sh -c "echo 'flash: neither openocd nor st-flash found: install openocd or stlink-tools and configure again' >&2 && false") # no semicolon: it would split the list
  endif()
  add_custom_target(flash COMMAND ${flash_command} DEPENDS h405 USES_TERMINAL VERBATIM)
endif()
