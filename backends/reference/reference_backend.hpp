#pragma once

#include "entry.hpp"
#include "host/host_backend.hpp"

namespace berth::reference_backend {

/// The definitions themselves, one call an operation.
host::HostOps ops();

BackendEntry entry();

}  // namespace berth::reference_backend
