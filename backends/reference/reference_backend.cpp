#include "reference_backend.hpp"

#include "reference/reference.hpp"
#include "signature.hpp"

namespace berth::reference_backend {

host::HostOps ops() {
  host::HostOps table;
#define X(op)                                                                                                       \
  table.ops[static_cast<std::size_t>(Op::op)] = {                                                                   \
      [](const void* params, void* const* buffers, int, int) { signature::call(&reference::op, params, buffers); }, \
      true};
  BERTH_OPS(X)
#undef X
  return table;
}

BackendEntry entry() {
  return {"reference", [](std::string&) { return std::vector<DeviceInfo>{host::processor("scalar definitions")}; },
          [](const BackendOptions& options) {
            host::check_device("reference", options);
            return host::make_host_backend("reference", host::processor("scalar definitions"), ops(), 1);
          }};
}

}  // namespace berth::reference_backend
