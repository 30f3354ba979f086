# SPDX-License-Identifier: MIT
# cmake -DFILES="a.html;b.css" -DNAME=page_files -DOUTPUT=page_files.h -P Embed.cmake
#
# Writes the files into a header, for a program that has to carry them: a table NAME of embedded_file_t
# (host_tools/base/embedded_file.h), and NAME_count.
set(arrays)
set(rows)
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  string(MAKE_C_IDENTIFIER ${name} identifier)
  string(PREPEND identifier ${NAME}_)
  file(READ ${file} bytes HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  string(REPLACE "0x0a," "0x0a,\n    " bytes "${bytes}")
  if(name MATCHES "[.]html$")
    set(type "text/html; charset=utf-8")
  elseif(name MATCHES "[.]css$")
    set(type "text/css; charset=utf-8")
  elseif(name MATCHES "[.]js$")
    set(type "text/javascript; charset=utf-8")
  else()
    message(FATAL_ERROR "${file}: what type of file is this?")
  endif()
  string(APPEND arrays "static const unsigned char ${identifier}[] = {\n    ${bytes}\n};\n")
  string(APPEND rows "    {\"${name}\", \"${type}\", ${identifier}, sizeof ${identifier}},\n")
endforeach()
file(WRITE ${OUTPUT} "/* Written by cmake/Embed.cmake. */
#include \"base/embedded_file.h\"
${arrays}static const embedded_file_t ${NAME}[] = {
${rows}};
static const size_t ${NAME}_count = sizeof ${NAME} / sizeof ${NAME}[0];
")
