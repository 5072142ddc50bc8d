# Cross-compiles for 64-bit Arm with Debian's compiler and the root of arm64 packages that tools/arm64-root makes
# (docs/aarch64.md). What the build and ctest run goes through qemu-user.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)

set(BERTH_ARM64_ROOT "" CACHE PATH "Folder of Debian's arm64 packages; empty for where tools/arm64-root makes it")
if(NOT BERTH_ARM64_ROOT)
  execute_process(COMMAND ${CMAKE_CURRENT_LIST_DIR}/../tools/arm64-root --where
                  OUTPUT_VARIABLE where OUTPUT_STRIP_TRAILING_WHITESPACE)
  set(BERTH_ARM64_ROOT ${where} CACHE PATH "" FORCE)
endif()
if(NOT EXISTS ${BERTH_ARM64_ROOT}/usr/lib/aarch64-linux-gnu)
  message(FATAL_ERROR "There are no arm64 packages in '${BERTH_ARM64_ROOT}': run tools/arm64-root")
endif()
# try_compile reads this file again, without the cache.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES BERTH_ARM64_ROOT)

find_program(BERTH_ARM64_CXX NAMES aarch64-linux-gnu-g++-12 aarch64-linux-gnu-g++)
find_program(BERTH_ARM64_CC NAMES aarch64-linux-gnu-gcc-12 aarch64-linux-gnu-gcc)
if(NOT BERTH_ARM64_CXX OR NOT BERTH_ARM64_CC)
  message(FATAL_ERROR "The cross compiler is missing: apt-get install g++-12-aarch64-linux-gnu")
endif()
set(CMAKE_C_COMPILER ${BERTH_ARM64_CC})
set(CMAKE_CXX_COMPILER ${BERTH_ARM64_CXX})
set(CMAKE_SYSROOT ${BERTH_ARM64_ROOT})
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

find_program(BERTH_QEMU_AARCH64 NAMES qemu-aarch64 qemu-aarch64-static)
if(NOT BERTH_QEMU_AARCH64)
  message(FATAL_ERROR "qemu-aarch64 is missing: apt-get install qemu-user")
endif()
set(CMAKE_CROSSCOMPILING_EMULATOR ${BERTH_QEMU_AARCH64} -L ${BERTH_ARM64_ROOT})

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${BERTH_ARM64_ROOT})
set(ENV{PKG_CONFIG_LIBDIR}
    ${BERTH_ARM64_ROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${BERTH_ARM64_ROOT}/usr/share/pkgconfig)
