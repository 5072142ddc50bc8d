#pragma once

#include <string>
#include <vector>

namespace berth {

/// One file of kernels/ as it was when the program was built.
struct KernelFile {
  const char* name;  // relative to kernels/
  const char* text;
};

/// Everything a device compiler needs, in order: prelude/opencl.h, ops.h, then what all.inl includes.
const std::vector<KernelFile>& opencl_kernel_files();

/// The files as one text; #line markers let build logs name the file and line.
inline std::string join(const std::vector<KernelFile>& files) {
  std::string source;
  for (const KernelFile& file : files) source += std::string("#line 1 \"kernels/") + file.name + "\"\n" + file.text;
  return source;
}

}  // namespace berth
