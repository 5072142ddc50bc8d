# What every target of Berth shares: the language, the warnings and the arithmetic's compiler flags.
add_library(berth_options INTERFACE)
target_compile_features(berth_options INTERFACE cxx_std_17)
# No fused multiply-add: the host's doubles are part of the result (docs/arithmetic.md).
target_compile_options(berth_options INTERFACE -ffp-contract=off -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                               -Wno-sign-conversion)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
  # Highway's SVE has vectors of run-time size, which cannot be members of structures as Berth's are. Processors with SVE
  # have NEON too.
  target_compile_definitions(berth_options INTERFACE "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
endif()
if(BERTH_WERROR)
  target_compile_options(berth_options INTERFACE -Werror)
endif()
if(BERTH_SANITIZE)
  target_compile_options(berth_options INTERFACE -fsanitize=${BERTH_SANITIZE} -fno-sanitize-recover=all
                                                 -fno-omit-frame-pointer)
  target_link_options(berth_options INTERFACE -fsanitize=${BERTH_SANITIZE})
endif()

# What an attacker would need is not writable, nor is the stack run: costs nothing once a program has started.
if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
  target_link_options(berth_options INTERFACE -Wl,-z,relro -Wl,-z,now -Wl,-z,noexecstack)
endif()
# The same as distributions compile with. Not _GLIBCXX_ASSERTIONS: SECURITY.md has what that costs.
if(BERTH_HARDENED)
  if(BERTH_SANITIZE)
    message(FATAL_ERROR "BERTH_HARDENED and BERTH_SANITIZE=${BERTH_SANITIZE} check the same things; give one of the two")
  endif()
  target_compile_options(berth_options INTERFACE $<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>
                                                 -fstack-protector-strong -fstack-clash-protection)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
    target_compile_options(berth_options INTERFACE -fcf-protection)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
    target_compile_options(berth_options INTERFACE -mbranch-protection=standard)
  endif()
endif()

# berth_library(NAME SOURCES...): a static library with Berth's options and include folders.
function(berth_library name)
  add_library(${name} STATIC ${ARGN})
  target_link_libraries(${name} PUBLIC berth_options)
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/kernels
                                            ${PROJECT_SOURCE_DIR}/src)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF)
endfunction()
