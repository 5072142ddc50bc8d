#pragma once

#include <cstddef>

/// How tests steer and question the fake driver, beside the driver API itself. It is looked up in the library by name,
/// as the driver's functions are. Thread-safe.
///
/// Environment, read when the library is loaded: FAKE_CUDA_DEVICES, as fake_cuda_set_devices takes it, and
/// FAKE_CUDA_FAIL=FUNCTION:NTH:STATUS, as fake_cuda_fail does.
#define FAKE_CUDA_CONTROLS(X)                                                                                         \
  /* One device of compute capability 9.0, CUDA 12.4, memory without end; no failures, no calls, no complaints. */    \
  X(void, fake_cuda_reset, ())                                                                                        \
  /* A device for each capability of "5.3,9.0", called "Fake GPU 0 (5.3)" and so on. */                               \
  X(void, fake_cuda_set_devices, (const char* capabilities))                                                          \
  X(void, fake_cuda_set_version, (int version))                                                                       \
  X(void, fake_cuda_set_memory, (std::size_t bytes))                                                                  \
  /* The nth call of the function from now on, counted from 1, does nothing and returns the status; and so do all */  \
  /* later ones of every function if it was `lasting`, as on a device that is lost. */                                \
  X(void, fake_cuda_fail, (const char* function, int nth, int status, bool lasting))                                  \
  /* The device is lost while it runs the nth kernel from now on, counted from 1. */                                  \
  X(void, fake_cuda_lose_at_kernel, (int nth))                                                                        \
  /* While held, streams take work but do none. */                                                                    \
  X(void, fake_cuda_hold, (bool held))                                                                                \
  /* Refuses images of that kind, "fatbin" or "ptx", with a status and a log. */                                      \
  X(void, fake_cuda_refuse, (const char* kind, int status, const char* log))                                          \
  X(int, fake_cuda_all_calls, ())                                                                                     \
  X(int, fake_cuda_calls, (const char* function))                                                                     \
  /* Objects of all kinds that are not given back: memory, modules, streams, events, graphs, contexts. */             \
  X(int, fake_cuda_live, ())                                                                                          \
  /* What was done wrong so far, a line each: handles that are none, memory out of bounds or not pinned, arguments */ \
  /* that do not fit the kernel, no context. Valid until the next call of it. */                                      \
  X(const char*, fake_cuda_complaints, ())                                                                            \
  /* The kind of the image loaded last, "fatbin" or "ptx". */                                                         \
  X(const char*, fake_cuda_loaded, ())
