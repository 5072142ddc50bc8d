#pragma once

#include "host/host_backend.hpp"

namespace berth::reference_backend {

/// The definitions themselves, one call an operation.
host::HostOps ops();

}  // namespace berth::reference_backend
