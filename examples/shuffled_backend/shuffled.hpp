#pragma once

#include "entry.hpp"

/// An example of a backend, small and whole (docs/adding-a-backend.md): the kernel text as C++ on the host, its
/// work-groups run in another random order at every launch. Its bits are everyone's all the same, which is what it is
/// good for: a kernel whose result hung on the order of its groups would not get past it.
namespace berth::shuffled {

BackendEntry entry();

}  // namespace berth::shuffled
