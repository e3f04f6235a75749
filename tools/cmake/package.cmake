# SPDX-License-Identifier: Apache-2.0
# cpack in the build folder makes a .deb and a tarball of what is installed. Libraries made ahead of time need a C++
# compiler, Eigen and fmt, and nothing of LLVM.
# The README, the manual and the examples as they lie here, so that their links and commands hold.
install(FILES README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
install(DIRECTORY dsl-examples DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN out EXCLUDE)

set(CPACK_GENERATOR DEB TGZ)
set(CPACK_PACKAGE_NAME dpde)
set(CPACK_PACKAGE_CONTACT "the authors of dpde <dpde@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "compiler for differentiable simulation")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS gnuplot-nox)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "g++, cmake, libeigen3-dev, libfmt-dev")
include(CPack)
