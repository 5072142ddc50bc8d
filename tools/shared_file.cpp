#include "shared_file.hpp"

#include <filesystem>

#include "berth/error.hpp"

namespace berth::cli {

std::string shared_file(const std::string& name, const std::string& remedy) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path candidates[] = {program.parent_path().parent_path() / "share" / "berth" / name,
                                 fs::path(BERTH_SOURCE_DIR) / name, fs::path(name)};
  for (const fs::path& candidate : candidates) {
    if (fs::exists(candidate, error)) return candidate.string();
  }
  throw Error(candidates[0].string() + " is not there; install Berth whole, or " + remedy);
}

}  // namespace berth::cli
