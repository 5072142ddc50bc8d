#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace berth::cli {

/// The processor's model name, and the vector extensions Berth's `simd` backend can use here, widest first.
struct Processor {
  std::string model;
  unsigned threads = 0;
  std::vector<std::string> vector_extensions;
};
Processor this_processor();

/// Where compiled kernels are kept.
struct KernelCache {
  std::string path;
  bool exists = false;
  bool writable = false;
  std::uint64_t entries = 0;
  std::uint64_t bytes = 0;
};
KernelCache kernel_cache();

/// Name and version of the system, e.g. "Debian GNU/Linux 12 (bookworm), Linux 6.1.0".
std::string this_system();

/// Of the OpenCV that is loaded, which may be newer than the one this was built with.
std::string opencv_version();

}  // namespace berth::cli
