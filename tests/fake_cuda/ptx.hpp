#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace fake_cuda {

/// The kernels of PTX text and the bytes of each of their arguments.
std::map<std::string, std::vector<std::size_t>> entries_of(const std::string& ptx);

}  // namespace fake_cuda
