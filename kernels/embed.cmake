# Writes the kernel text for a language compiled at run time into a C++ source, file by file:
#   cmake -DKERNELS=… -DPRELUDE=prelude/opencl.h -DSYMBOL=opencl_kernel_files -DOUT=… -P embed.cmake
# The order is the prelude, ops.h, then what all.inl includes. Every file stays a literal of its own, so that build
# logs can name it and no literal passes the 64 KiB that the C++ standard promises.
cmake_minimum_required(VERSION 3.18)

file(STRINGS ${KERNELS}/all.inl includes REGEX "^#include ")
set(files ${PRELUDE} ops.h)
foreach(line IN LISTS includes)
  string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" file "${line}")
  list(APPEND files ${file})
endforeach()

set(source "// Generated from kernels/ by kernels/embed.cmake.\n#include \"kernel_text.hpp\"\n\nnamespace berth {\n\n")
string(APPEND source "const std::vector<KernelFile>& ${SYMBOL}() {\n  static const std::vector<KernelFile> files = {\n")
foreach(file IN LISTS files)
  file(READ ${KERNELS}/${file} text)
  file(SIZE ${KERNELS}/${file} size)
  if(size GREATER 65000)
    message(FATAL_ERROR "kernels/${file} has ${size} bytes; a string literal holds 65,000: split the file")
  endif()
  string(FIND "${text}" ")kernel\"" closing)
  if(NOT closing EQUAL -1)
    message(FATAL_ERROR "kernels/${file} contains )kernel\", which ends the literal it is embedded in")
  endif()
  string(APPEND source "{\"${file}\", R\"kernel(${text})kernel\"},\n")
endforeach()
string(APPEND source "  };\n  return files;\n}\n\n}  // namespace berth\n")
file(WRITE ${OUT} "${source}")
