# SPDX-License-Identifier: MIT
# cmake -DINPUT=plot.js -DNAME=plot_script -DOUTPUT=plot_script.h -P EmbedText.cmake
#
# Writes a text file in ASCII as an array of characters that ends with a zero, for a program that has to carry it.
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
string(REPLACE "0x0a," "0x0a,\n" bytes "${bytes}")
file(WRITE ${OUTPUT} "static const char ${NAME}[] = {\n${bytes}0x00};\n")
