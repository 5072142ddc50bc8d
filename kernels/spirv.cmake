# The kernel text as SPIR-V, for Vulkan.
#
# berth_embed_spirv(OUT): sets OUT to a generated source that defines spirv_kernel() of spirv_kernels.hpp. Each
# operation of ops.h becomes a shader of its own, and another for processors where its text says LANES_IF, and
# where it says STRIDE_IF (see prelude/glsl.h), compiled by glslangValidator and checked by spirv-val.
#
# Run as a script (cmake -DKERNELS=… -DMODULES=a.spv;b.lanes.spv;b.spv -DLANES=8 -DOUT=… -P spirv.cmake) it writes that source.
if(CMAKE_SCRIPT_MODE_FILE)
  set(source "// Generated from kernels/ by kernels/spirv.cmake.\n#include \"spirv_kernels.hpp\"\n\nnamespace berth {\n")
  string(APPEND source "namespace {\n\nconst SpirvKernel none = {nullptr, 0, 0, nullptr};\n")
  set(ops "")
  foreach(module IN LISTS MODULES)
    get_filename_component(op ${module} NAME_WE)
    file(READ ${module} bytes HEX)
    string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u," words "${bytes}")
    if(module MATCHES "\\.(lanes|stride)\\.spv$")
      set(form ${CMAKE_MATCH_1})
      string(TOUPPER ${form}_IF word)
      file(STRINGS ${KERNELS}/${op}.inl condition REGEX "^${word}\\(")
      string(REGEX REPLACE "^${word}\\((.*)\\).*" "\\1" condition "${condition}")
      set(groups 1)
      if(form STREQUAL "lanes")
        set(groups ${LANES})
      endif()
      string(APPEND source "const u32 ${op}_${form}[] = {${words}};\n"
                           "bool ${op}_${form}_if(const void* params) {\n"
                           "  [[maybe_unused]] const auto& p = *static_cast<const ${op}_params*>(params);\n"
                           "  return ${condition};\n}\n")
      set(${form}_${op} "{${op}_${form}, sizeof ${op}_${form}, ${groups}, &${op}_${form}_if}")
    else()
      string(APPEND source "const u32 ${op}[] = {${words}};\n")
      set(any_${op} "{${op}, sizeof ${op}, 1, nullptr}")
      set(lanes_${op} none)
      set(stride_${op} none)
      list(APPEND ops ${op})
    endif()
  endforeach()
  set(table "")
  foreach(op IN LISTS ops)
    string(APPEND table "  case Op::${op}: {\n    static const SpirvKernel forms[] = {${any_${op}}, ${lanes_${op}}, "
                        "${stride_${op}}};\n    return forms[static_cast<int>(form)];\n  }\n")
  endforeach()
  string(APPEND source "\n}  // namespace\n\nconst SpirvKernel& spirv_kernel(Op op, SpirvForm form) {\n  switch (op) {\n"
                       "${table}  }\n  return none;\n}\n\n}  // namespace berth\n")
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
#include \"tensor.h\"
#include \"@op@.inl\"
")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${BERTH_KERNELS_DIR}/${op}.inl)
    file(STRINGS ${BERTH_KERNELS_DIR}/${op}.inl shared REGEX "^SHARED\\(")
    set(variants ${op})
    foreach(form lanes stride)
      string(TOUPPER ${form}_IF word)
      file(STRINGS ${BERTH_KERNELS_DIR}/${op}.inl condition REGEX "^${word}\\(")
      if(condition)
        list(APPEND variants ${op}.${form})
      endif()
    endforeach()
    foreach(variant IN LISTS variants)
      set(definition "")
      if(variant MATCHES "lanes$")
        set(definition -DBERTH_LANE_GROUPS=${lanes})
      elseif(variant MATCHES "stride$")
        set(definition -DBERTH_STRIDE=${lanes})
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
