#include <fstream>

#include "berth/error.hpp"
#include "host/host_backend.hpp"

namespace berth::host {

DeviceInfo processor(const std::string& driver) {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const std::size_t colon = line.find(": ");
    if (line.compare(0, 10, "model name") == 0 && colon != std::string::npos) return {line.substr(colon + 2), driver};
  }
  return {"processor", driver};
}

void check_device(const char* backend, const BackendOptions& options) {
  if (!options.device.empty() && options.device != "0") {
    throw Error(std::string(backend) + ": no device '" + options.device + "'; it has one, 0");
  }
}

}  // namespace berth::host
