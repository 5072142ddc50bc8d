// Every operation as CUDA C++: what nvcc, NVRTC and Clang compile (docs/cuda.md).
// clang-format off
#include "prelude/cuda.h"
#include "ops.h"
#include "all.inl"
// clang-format on
