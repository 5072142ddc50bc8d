#pragma once

namespace berth {

/// Keeps the calling thread to one core. Throws Error where the process may not use it.
void pin_to_core(int core);

/// Gives the calling thread a SCHED_FIFO priority of 1 to 99. Throws Error that says how to be permitted.
void make_realtime(int priority);

/// Gives the calling thread the usual scheduling back.
void make_ordinary();

/// Has the calling thread stand back where others want the processor (nice 10, of this thread alone).
void make_background();

/// What the calling thread is called in top and in debuggers: 15 characters.
void name_thread(const char* name);

}  // namespace berth
