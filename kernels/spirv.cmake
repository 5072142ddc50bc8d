# The kernel text as SPIR-V, for Vulkan.
#
# berth_embed_spirv(OUT): sets OUT to a generated source that defines spirv_kernel() of spirv_kernels.hpp. Each
# operation of ops.h becomes a shader of its own, compiled by glslangValidator and checked by spirv-val.
#
# Run as a script (cmake -DMODULES=a.spv;b.spv -DOUT=… -P spirv.cmake) it writes that source.
if(CMAKE_SCRIPT_MODE_FILE)
  set(source "// Generated from kernels/ by kernels/spirv.cmake.\n#include \"spirv_kernels.hpp\"\n\nnamespace berth {\n")
  string(APPEND source "namespace {\n\n")
  set(table "")
  foreach(module IN LISTS MODULES)
    get_filename_component(op ${module} NAME_WE)
    file(READ ${module} bytes HEX)
    string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u," words "${bytes}")
    string(APPEND source "const u32 ${op}[] = {${words}};\n")
    string(APPEND table "  case Op::${op}: {\n    static const SpirvKernel kernel = {${op}, sizeof ${op}};\n"
                        "    return kernel;\n  }\n")
  endforeach()
  string(APPEND source "const SpirvKernel none = {nullptr, 0};\n\n}  // namespace\n\n"
                       "const SpirvKernel& spirv_kernel(Op op) {\n  switch (op) {\n${table}  }\n  return none;\n}\n\n"
                       "}  // namespace berth\n")
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
    add_custom_command(
      OUTPUT ${folder}/${op}.spv
      COMMAND ${BERTH_GLSLANG} -V --quiet --target-env vulkan1.1 -g0 -I${BERTH_KERNELS_DIR} -o ${folder}/${op}.spv
              ${folder}/${op}.comp
      COMMAND ${BERTH_SPIRV_VAL} --target-env vulkan1.1 ${folder}/${op}.spv
      DEPENDS ${texts} ${folder}/${op}.comp
      COMMENT "Compiling ${op} to SPIR-V" VERBATIM)
    list(APPEND modules ${folder}/${op}.spv)
  endforeach()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/spirv_kernels.cpp)
  add_custom_command(
    OUTPUT ${source}
    COMMAND ${CMAKE_COMMAND} "-DMODULES=${modules}" -DOUT=${source} -P ${BERTH_SPIRV_SCRIPT}
    DEPENDS ${modules} ${BERTH_SPIRV_SCRIPT}
    COMMENT "Embedding the SPIR-V kernels" VERBATIM)
  set(${out} ${source} PARENT_SCOPE)
endfunction()
