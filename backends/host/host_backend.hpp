#pragma once

#include <memory>
#include <string>

#include "berth/backend.hpp"

namespace berth::host {

/// Runs groups [first, last) of an operation on host memory. Calls for different groups may run at the same time.
using RunGroups = void (*)(const void* params, void* const* buffers, int first, int last);

/// How one operation runs on this backend.
struct HostOp {
  RunGroups run = nullptr;
  /// The function does the whole operation when called for group 0; it is called once.
  bool whole = false;
  /// Into how many parts the work falls where they are not groups: `run` is called with parts then. 0 for parameters
  /// that it cannot do, which `other` does by groups.
  int (*parts)(const void* params) = nullptr;
  RunGroups other = nullptr;
  /// Works in the stream's workspace, which lies behind the last buffer; only where it does the whole operation.
  bool workspace = false;
};

/// A table of operations by Op, filled by a CPU backend.
struct HostOps {
  HostOp ops[32];
  /// Makes a stream's workspace, where any operation needs one. What it takes then or in a plan's first run it keeps.
  std::shared_ptr<void> (*make_workspace)() = nullptr;
};

/// How buffers are taken from operator new.
enum class Chunks {
  shared,  ///< many lie in a chunk that the system may put on pages of 2 MB; in sanitizers' builds as `single`
  single,  ///< each has one to itself, no larger than it must be
};

/// A backend whose buffers are host memory and whose operations are functions; work is done while it is enqueued.
/// `threads` share an operation's groups (0: every core).
std::unique_ptr<Backend> make_host_backend(const char* name, DeviceInfo device, const HostOps& ops, int threads,
                                           Chunks chunks = Chunks::shared);

/// This machine's processor as the device of a CPU backend; `driver` says what runs on it.
DeviceInfo processor(const std::string& driver);

/// Throws Error unless options.device names the one device a CPU backend has.
void check_device(const char* backend, const BackendOptions& options);

}  // namespace berth::host
