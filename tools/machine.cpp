#include "machine.hpp"

#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/core/utility.hpp>
#include <sstream>
#include <thread>

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

/// The value after "KEY<tabs>: " or "KEY=" on the first such line; empty when there is none.
std::string value_in(const char* path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.compare(0, key.size(), key) != 0) continue;
    const std::size_t start = line.find_first_not_of("\t :=\"", key.size());
    if (start == std::string::npos || start == key.size()) continue;
    return line.substr(start, line.find_last_not_of("\" \t") + 1 - start);
  }
  return "";
}

}  // namespace

Processor this_processor() {
  Processor processor;
  processor.threads = std::thread::hardware_concurrency();
  processor.model = value_in("/proc/cpuinfo", "model name");
  if (processor.model.empty()) processor.model = value_in("/proc/device-tree", "model");
  std::istringstream flags(value_in("/proc/cpuinfo", "flags") + " " + value_in("/proc/cpuinfo", "Features"));
  std::string present = " ";
  for (std::string flag; flags >> flag;) present += flag + " ";
  for (const char* name : {"avx512bw", "avx2", "sse4_1", "sve2", "sve", "asimd", "neon"}) {
    if (present.find(" " + std::string(name) + " ") != std::string::npos) processor.vector_extensions.push_back(name);
  }
  return processor;
}

KernelCache kernel_cache() {
  KernelCache cache;
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  const fs::path base =
      xdg != nullptr && xdg[0] != '\0' ? fs::path(xdg) : fs::path(home == nullptr ? "/tmp" : home) / ".cache";
  cache.path = (base / "berth").string();
  std::error_code error;
  cache.exists = fs::is_directory(cache.path, error);
  // What does not exist yet is made by the first run: then the nearest folder above must let it.
  fs::path nearest = cache.path;
  while (!nearest.empty() && nearest != nearest.root_path() && !fs::exists(nearest, error))
    nearest = nearest.parent_path();
  cache.writable = access(nearest.c_str(), W_OK) == 0;
  if (!cache.exists) return cache;
  fs::recursive_directory_iterator entry(cache.path, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    std::error_code gone;
    if (!entry->is_regular_file(gone)) continue;
    const std::uintmax_t bytes = entry->file_size(gone);
    if (gone) continue;
    ++cache.entries;
    cache.bytes += bytes;
  }
  return cache;
}

std::string this_system() {
  utsname name = {};
  uname(&name);
  std::string system = value_in("/etc/os-release", "PRETTY_NAME");
  if (!system.empty()) system += ", ";
  return system + name.sysname + " " + name.release + ", " + name.machine;
}

std::string opencv_version() { return cv::getVersionString(); }

}  // namespace berth::cli
