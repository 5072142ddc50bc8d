#pragma once

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "berth/types.hpp"

/// What is run on bytes of which nothing is known: everything that reads what others wrote.
namespace berth::fuzz {

struct Target {
  const char* name;
  /// Returns on every input: an Error is an answer, anything else thrown, a sanitizer's complaint or an abort is a
  /// fault.
  void (*run)(const u8* bytes, std::size_t count);
  /// Whole inputs to begin with: globs below the repository's root; `tests/fuzz/corpus/NAME/*` comes on top.
  std::vector<std::string> seeds;
  /// How many cut or damaged seeds tests/fuzz_test.cpp tries: fewer where one takes long.
  int inputs = 240;
};

const std::vector<Target>& targets();

/// The one of that name; null where there is none.
const Target* find_target(const char* name);

/// Ends the program, saying why; for what must hold whatever the input.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

void camera_file(const u8* bytes, std::size_t count);
void bundle_file(const u8* bytes, std::size_t count);
void disc_target_file(const u8* bytes, std::size_t count);
void scenario_file(const u8* bytes, std::size_t count);
void machine_file(const u8* bytes, std::size_t count);
void network_file(const u8* bytes, std::size_t count);
void recording_file(const u8* bytes, std::size_t count);
void recorded_text(const u8* bytes, std::size_t count);
void recorded_image(const u8* bytes, std::size_t count);
void source_options(const u8* bytes, std::size_t count);
void image_file(const u8* bytes, std::size_t count);
void camera_pixels(const u8* bytes, std::size_t count);
void marker_frame(const u8* bytes, std::size_t count);

}  // namespace berth::fuzz
