#include "ptx.hpp"

#include <cstdlib>
#include <sstream>

namespace fake_cuda {
namespace {

/// ".param .u64 name," is 8; ".param .align 4 .b8 name[16]" is 16.
std::size_t bytes_of(const std::string& param) {
  const std::size_t bracket = param.find('[');
  if (bracket != std::string::npos) return static_cast<std::size_t>(std::atoi(param.c_str() + bracket + 1));
  return param.find(".u64") != std::string::npos ? 8 : 4;
}

}  // namespace

std::map<std::string, std::vector<std::size_t>> entries_of(const std::string& ptx) {
  std::map<std::string, std::vector<std::size_t>> entries;
  std::istringstream lines(ptx);
  std::vector<std::size_t>* params = nullptr;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t entry = line.find(".entry ");
    if (entry != std::string::npos) {
      const std::size_t name = entry + 7;
      params = &entries[line.substr(name, line.find_first_of("( ", name) - name)];
    }
    if (params != nullptr && line.find(".param ") != std::string::npos) params->push_back(bytes_of(line));
    if (line.find(')') != std::string::npos) params = nullptr;
  }
  return entries;
}

}  // namespace fake_cuda
