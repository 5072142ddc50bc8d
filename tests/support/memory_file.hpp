#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

namespace berth::test {

/// A file in memory, by a path of its own: for tests that write thousands of files, one after the other.
class MemoryFile {
 public:
  MemoryFile() : file_(memfd_create("berth-test", 0)) {
    if (file_ < 0) throw std::runtime_error("no file in memory");
  }
  ~MemoryFile() { close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }
  /// Makes this the file's whole content.
  template <class Bytes>
  void fill(const Bytes& bytes) {
    if (ftruncate(file_, 0) != 0 ||
        pwrite(file_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
      throw std::runtime_error("the file in memory cannot be written");
    }
  }

 private:
  int file_;
};

}  // namespace berth::test
