#include "cpu_backend.hpp"

namespace berth::cpu_backend {

BackendEntry entry() {
  return {"cpu", [](std::string&) { return std::vector<DeviceInfo>{host::processor("kernel text as C++")}; },
          [](const BackendOptions& options) {
            host::check_device("cpu", options);
            return host::make_host_backend("cpu", host::processor("kernel text as C++"), ops(), options.threads);
          }};
}

}  // namespace berth::cpu_backend
