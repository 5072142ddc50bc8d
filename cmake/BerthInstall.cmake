# What is installed, in three parts: `runtime` is libberth.so; `dev` what others build with, CMake's and pkg-config's
# files too; `tools` the command and the files that come with it (tools/CMakeLists.txt).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS berth_shared EXPORT berthTargets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT dev
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})

# The C++ interface as one static library: what the engine is made of, without OpenCV.
add_library(berth_cpp STATIC)
add_library(berth::cpp ALIAS berth_cpp)
foreach(part IN ITEMS berth_target berth_reference berth_core berth_pipeline berth_navigation berth_pilot berth_host
                      berth_simd berth_cache_file berth_backends berth_opencl berth_vulkan berth_cuda)
  if(TARGET ${part})
    target_sources(berth_cpp PRIVATE $<TARGET_OBJECTS:${part}>)
  endif()
endforeach()
find_package(yaml-cpp REQUIRED)
find_package(HWY REQUIRED)
find_package(Threads REQUIRED)
target_compile_features(berth_cpp PUBLIC cxx_std_17)
target_include_directories(berth_cpp INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                                               $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/kernels>)
target_link_libraries(berth_cpp PRIVATE yaml-cpp hwy::hwy Threads::Threads ${CMAKE_DL_LIBS})
set_target_properties(berth_cpp PROPERTIES EXPORT_NAME cpp LINKER_LANGUAGE CXX)
install(TARGETS berth_cpp EXPORT berthCppTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)
# berth/ops.hpp includes it from beside itself, or from kernels/.
install(FILES ${PROJECT_SOURCE_DIR}/kernels/ops.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/berth COMPONENT dev)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/berth)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/berthConfig.cmake.in ${PROJECT_BINARY_DIR}/berthConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
# Before 1.0 the minor version is where things change.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/berthConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/berthConfig.cmake ${PROJECT_BINARY_DIR}/berthConfigVersion.cmake
        DESTINATION ${package_dir} COMPONENT dev)
install(EXPORT berthTargets NAMESPACE berth:: DESTINATION ${package_dir} COMPONENT dev)
install(EXPORT berthCppTargets NAMESPACE berth:: DESTINATION ${package_dir} COMPONENT dev)

# From where the .pc files are to the prefix, so that a tree can be moved.
file(RELATIVE_PATH BERTH_PC_TO_PREFIX /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" BERTH_PC_TO_PREFIX "${BERTH_PC_TO_PREFIX}")
set(pc_files berth berth-cpp)
if(TARGET berth::core)
  install(FILES ${PROJECT_BINARY_DIR}/libberth-core.a DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
  list(APPEND pc_files berth-core)
endif()
foreach(name IN LISTS pc_files)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endforeach()
