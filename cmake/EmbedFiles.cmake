# SPDX-License-Identifier: MIT
# cmake -DFILES="a.html;b.css" -DOUTPUT=files.h -P EmbedFiles.cmake
#
# Writes the files as C arrays, in a table serve_page_files: name, media type, bytes. page.html has the empty name, which
# is that of the address itself.
set(arrays)
set(rows)
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  string(MAKE_C_IDENTIFIER ${name} identifier)
  file(READ ${file} bytes HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  string(REGEX REPLACE "(................................................................................)" "\\1\n    "
         bytes "${bytes}")
  if(name MATCHES "[.]html$")
    set(type "text/html; charset=utf-8")
    set(name "")
  elseif(name MATCHES "[.]css$")
    set(type "text/css; charset=utf-8")
  else()
    set(type "text/javascript; charset=utf-8")
  endif()
  string(APPEND arrays "static const unsigned char ${identifier}[] = {\n    ${bytes}\n};\n")
  string(APPEND rows "    {\"${name}\", \"${type}\", ${identifier}, sizeof ${identifier}},\n")
endforeach()
file(WRITE ${OUTPUT} "/* Written by cmake/EmbedFiles.cmake. */
#include <stddef.h>
typedef struct {
    const char *name, *type;
    const unsigned char *data;
    size_t length;
} serve_page_file_t;
${arrays}static const serve_page_file_t serve_page_files[] = {
${rows}};
static const size_t serve_page_files_count = sizeof serve_page_files / sizeof serve_page_files[0];
")
