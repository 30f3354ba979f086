# SPDX-License-Identifier: GPL-3.0-or-later
# cpack --config build/host/CPackConfig.cmake: a Debian package of what `cmake --install` installs. The libraries that it
# depends on are those that dpkg-shlibdeps finds in the command, so it fits the Debian that it was made on.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the maintainers of hyst <hyst@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "identify, diagnose and linearise a piezo actuator's hysteresis")
set(CPACK_PACKAGE_DESCRIPTION "The command hyst, its manual pages, its completion for bash, zsh and fish, and its documents.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS qemu-system-arm) # hyst bench
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
include(CPack)
