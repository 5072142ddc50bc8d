# The kernel text as SPIR-V, for Vulkan.
#
# berth_embed_spirv(OUT): sets OUT to a generated source that defines spirv_kernel() of spirv_kernels.hpp. Each
# operation of ops.h becomes a shader of its own, and another for processors where its text says LANES_IF (see
# prelude/glsl.h), compiled by glslangValidator and checked by spirv-val.
#
# Run as a script (cmake -DKERNELS=… -DMODULES=a.spv;b.lanes.spv;b.spv -DLANES=8 -DOUT=… -P spirv.cmake) it writes that source.
if(CMAKE_SCRIPT_MODE_FILE)
  set(source "// Generated from kernels/ by kernels/spirv.cmake.\n#include \"spirv_kernels.hpp\"\n\nnamespace berth {\n")
  string(APPEND source "namespace {\n\n")
  set(ops "")
  foreach(module IN LISTS MODULES)
    get_filename_component(op ${module} NAME_WE)
    file(READ ${module} bytes HEX)
    string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u," words "${bytes}")
    if(module MATCHES "\\.lanes\\.spv$")
      file(STRINGS ${KERNELS}/${op}.inl condition REGEX "^LANES_IF\\(")
      string(REGEX REPLACE "^LANES_IF\\((.*)\\).*" "\\1" condition "${condition}")
      string(APPEND source "const u32 ${op}_lanes[] = {${words}};\n"
                           "bool ${op}_lanes_if(const void* params) {\n"
                           "  [[maybe_unused]] const auto& p = *static_cast<const ${op}_params*>(params);\n"
                           "  return ${condition};\n}\n")
      set(lanes_of_${op} "{${op}_lanes, sizeof ${op}_lanes, ${LANES}, &${op}_lanes_if}")
    else()
      string(APPEND source "const u32 ${op}[] = {${words}};\n")
      set(lanes_of_${op} "{nullptr, 0, 0, nullptr}")
      list(APPEND ops ${op})
    endif()
  endforeach()
  set(table "")
  foreach(op IN LISTS ops)
    string(APPEND table "  case Op::${op}: {\n    static const SpirvKernel kernels[] = {{${op}, sizeof ${op}, 1, nullptr}, "
                        "${lanes_of_${op}}};\n    return kernels[lanes ? 1 : 0];\n  }\n")
  endforeach()
  string(APPEND source "const SpirvKernel none = {nullptr, 0, 0, nullptr};\n\n}  // namespace\n\n"
                       "const SpirvKernel& spirv_kernel(Op op, bool lanes) {\n  switch (op) {\n${table}  }\n"
                       "  return none;\n}\n\n}  // namespace berth\n")
  file(WRITE ${OUT} "${source}")
  return()
endif()

set(BERTH_SPIRV_SCRIPT ${CMAKE_CURRENT_LIST_FILE} CACHE INTERNAL "")
function(berth_embed_spirv out)
  find_program(BERTH_GLSLANG NAMES glslangValidator glslang)
  find_program(BERTH_SPIRV_VAL spirv-val)
  if(NOT BERTH_GLSLANG OR NOT BERTH_SPIRV_VAL)
    message(FATAL_ERROR "The Vulkan backend needs glslangValidator and spirv-val: apt install glslang-tools spirv-tools, "
                        "or pass -DBERTH_WITH_VULKAN=OFF")
  endif()
  set(lanes 8)  # 32-bit lanes of an AVX2 register
  file(READ ${BERTH_KERNELS_DIR}/ops.h declarations)
  string(REGEX MATCHALL "X\\([a-z0-9_]+\\)" ops "${declarations}")
  file(GLOB texts CONFIGURE_DEPENDS ${BERTH_KERNELS_DIR}/*.h ${BERTH_KERNELS_DIR}/*.inl)
  list(APPEND texts ${BERTH_KERNELS_DIR}/prelude/glsl.h)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${BERTH_KERNELS_DIR}/ops.h)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/spirv)
  set(modules "")
  foreach(op IN LISTS ops)
    string(REGEX REPLACE "X\\((.*)\\)" "\\1" op ${op})
    # file(CONFIGURE) leaves an unchanged file alone.
    file(CONFIGURE OUTPUT ${folder}/${op}.comp @ONLY CONTENT "#version 450
#extension GL_GOOGLE_include_directive : require
#include \"prelude/glsl.h\"
#include \"ops.h\"
#include \"fixed.h\"
#include \"runs.h\"
#include \"@op@.inl\"
")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${BERTH_KERNELS_DIR}/${op}.inl)
    file(STRINGS ${BERTH_KERNELS_DIR}/${op}.inl shared REGEX "^SHARED\\(")
    file(STRINGS ${BERTH_KERNELS_DIR}/${op}.inl lanes_if REGEX "^LANES_IF\\(")
    set(variants ${op})
    if(lanes_if)
      list(APPEND variants ${op}.lanes)
    endif()
    foreach(variant IN LISTS variants)
      set(definition "")
      if(variant MATCHES "lanes$")
        set(definition -DBERTH_LANE_GROUPS=${lanes})
      elseif(NOT shared)
        set(definition -DBERTH_NO_SHARED)
      endif()
      add_custom_command(
        OUTPUT ${folder}/${variant}.spv
        COMMAND ${BERTH_GLSLANG} -V --quiet --target-env vulkan1.1 -g0 ${definition} -I${BERTH_KERNELS_DIR}
                -o ${folder}/${variant}.spv ${folder}/${op}.comp
        COMMAND ${BERTH_SPIRV_VAL} --target-env vulkan1.1 ${folder}/${variant}.spv
        DEPENDS ${texts} ${folder}/${op}.comp
        COMMENT "Compiling ${variant} to SPIR-V" VERBATIM)
      list(APPEND modules ${folder}/${variant}.spv)
    endforeach()
  endforeach()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/spirv_kernels.cpp)
  add_custom_command(
    OUTPUT ${source}
    COMMAND ${CMAKE_COMMAND} -DKERNELS=${BERTH_KERNELS_DIR} "-DMODULES=${modules}" -DLANES=${lanes} -DOUT=${source} -P ${BERTH_SPIRV_SCRIPT}
    DEPENDS ${modules} ${BERTH_SPIRV_SCRIPT}
    COMMENT "Embedding the SPIR-V kernels" VERBATIM)
  set(${out} ${source} PARENT_SCOPE)
endfunction()
