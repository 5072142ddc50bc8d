#pragma once

#include <memory>

#include "frame_observer.hpp"

namespace berth::cli {

/// Tells systemd about the frames of `berth run` by sd_notify's protocol: READY=1 with the first, WATCHDOG=1 with those
/// that come out (ten times a second at most), STOPPING=1 at the end. Frames that do not come out say nothing, so that
/// WatchdogSec= restarts a service whose camera or device hangs. Null unless a service manager asks for it
/// ($NOTIFY_SOCKET). Throws Error where that names no socket.
std::unique_ptr<FrameObserver> service_notify();

}  // namespace berth::cli
