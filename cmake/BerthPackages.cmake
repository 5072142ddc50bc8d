# Debian packages by CPack, one for each part of BerthInstall.cmake: libberth0, libberth-dev, berth (docs/packages.md).
set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL runtime dev tools)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_VENDOR "the authors of Berth")
set(BERTH_PACKAGE_CONTACT "the authors of Berth <berth@localhost>" CACHE STRING "Maintainer of the Debian packages")
set(CPACK_PACKAGE_CONTACT ${BERTH_PACKAGE_CONTACT})
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME libberth0)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "docking vision: the library
 Finds square markers and targets of discs in camera images and says where
 they are, with covariance. Here is the shared library with the C interface.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libberth-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
# yaml-cpp and Highway are for the C++ interface, a static library.
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libberth0 (= ${PROJECT_VERSION}), libyaml-cpp-dev, libhwy-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION "docking vision: what others build with
 Headers of the C and the C++ interface, the static C++ library, files for
 CMake and pkg-config.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME berth)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SUGGESTS "ocl-icd-libopencl1, libvulkan1")
if(BERTH_WITH_GSTREAMER)
  # appsink and videoconvert; v4l2src, jpegdec.
  set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS "gstreamer1.0-plugins-base, gstreamer1.0-plugins-good")
endif()
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "docking vision: the command
 Finds markers in images, streams and cameras, calibrates, simulates, measures.
 A service unit for systemd comes with it and is not enabled.")

# Beside each package's licence, what it is made of: written when the packages are, from what the build has linked.
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/package_sboms.cmake)
set(CPACK_BERTH_BUILD ${PROJECT_BINARY_DIR})
set(CPACK_BERTH_MAKE_SBOM ${PROJECT_SOURCE_DIR}/tools/make-sbom)
set(CPACK_BERTH_LIBRARY libberth.so.${PROJECT_VERSION})
install(FILES ${PROJECT_SOURCE_DIR}/packaging/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libberth0
        COMPONENT runtime)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libberth-dev COMPONENT dev)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/berth COMPONENT tools)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/berth COMPONENT tools
        PATTERN Doxyfile EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/berth.service DESTINATION lib/systemd/system COMPONENT tools)
install(FILES ${PROJECT_SOURCE_DIR}/packaging/berth.toml DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/berth/examples
        COMPONENT tools)
include(CPack)
