#pragma once

#include "entry.hpp"
#include "host/host_backend.hpp"

namespace berth::cpu_backend {

/// The kernel text as C++, group by group: what every other language runs, open to sanitizers.
host::HostOps ops();

BackendEntry entry();

}  // namespace berth::cpu_backend
