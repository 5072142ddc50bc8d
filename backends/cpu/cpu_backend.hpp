#pragma once

#include "host/host_backend.hpp"

namespace berth::cpu_backend {

/// The kernel text as C++, group by group: what every other language runs, open to sanitizers.
host::HostOps ops();

}  // namespace berth::cpu_backend
