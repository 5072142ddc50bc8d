#pragma once

namespace berth::cli {

/// Holds up the threads of this process that have a name (name_thread) for 100 ms, as a machine would that has no core
/// for them: by a signal, SIGUSR2, whose handler sleeps. False where there is none of that name.
bool stop_thread(const char* name);

}  // namespace berth::cli
