#include "simd_backend.hpp"

namespace berth::simd_backend {

BackendEntry entry() {
  return {"simd", [](std::string&) { return std::vector<DeviceInfo>{host::processor(target_name())}; },
          [](const BackendOptions& options) {
            host::check_device("simd", options);
            return host::make_host_backend("simd", host::processor(target_name()), ops(), options.threads);
          }};
}

}  // namespace berth::simd_backend
