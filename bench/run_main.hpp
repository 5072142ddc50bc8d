#pragma once

#include <fmt/core.h>

#include <cstdio>
#include <exception>

namespace berth::bench {

/// What main does in each of these programs: runs it, and says under its name what went wrong. Returns the exit code.
inline int run_main(const char* name, int (*run)(int, char**), int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return 2;
  }
}

}  // namespace berth::bench
