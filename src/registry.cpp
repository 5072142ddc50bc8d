// The only file that names backends.
#include <utility>

#include "berth/backend.hpp"
#include "berth/error.hpp"
#include "cpu/cpu_backend.hpp"
#include "host/host_backend.hpp"
#include "reference/reference_backend.hpp"
#include "simd/simd_backend.hpp"
#if BERTH_WITH_OPENCL
#include "opencl/opencl.hpp"
#endif

namespace berth {
namespace {

std::string near_names(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

DeviceInfo processor(const std::string& driver) { return {host::processor_name(), driver}; }

void check_host_device(const char* name, const BackendOptions& options) {
  if (!options.device.empty() && options.device != "0") {
    throw Error(std::string(name) + ": no device '" + options.device + "'; it has one, 0");
  }
}

}  // namespace

const std::vector<std::string>& backend_names() {
  static const std::vector<std::string> names = {
    "simd",
    "cpu",
#if BERTH_WITH_OPENCL
    "opencl",
#endif
    "reference",
  };
  return names;
}

std::vector<BackendStatus> probe_backends() {
  std::vector<BackendStatus> found;
  found.push_back({"simd", {processor(simd_backend::target_name())}, ""});
  found.push_back({"cpu", {processor("kernel text as C++")}, ""});
#if BERTH_WITH_OPENCL
  BackendStatus opencl{"opencl", {}, ""};
  opencl.devices = opencl::devices(opencl.absent);
  found.push_back(std::move(opencl));
#endif
  found.push_back({"reference", {processor("scalar definitions")}, ""});
  return found;
}

std::unique_ptr<Backend> open_backend(const std::string& name, const BackendOptions& options) {
  if (options.threads < 0 || options.threads > 256) {
    throw Error("threads is " + std::to_string(options.threads) + "; give 1 to 256, or 0 for every core");
  }
  if (name == "simd") {
    check_host_device("simd", options);
    return host::make_host_backend("simd", processor(simd_backend::target_name()), simd_backend::ops(),
                                   options.threads);
  }
  if (name == "cpu") {
    check_host_device("cpu", options);
    return host::make_host_backend("cpu", processor("kernel text as C++"), cpu_backend::ops(), options.threads);
  }
  if (name == "reference") {
    check_host_device("reference", options);
    return host::make_host_backend("reference", processor("scalar definitions"), reference_backend::ops(), 1);
  }
#if BERTH_WITH_OPENCL
  if (name == "opencl") return opencl::open(options);
#endif
  throw Error("no backend '" + name + "'; this build has " + near_names(backend_names()));
}

}  // namespace berth
