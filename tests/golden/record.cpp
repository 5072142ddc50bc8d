// Prints golden values on standard output, as tests/data/golden_*.txt have them: golden_record frames|network
// [BACKEND]. On another machine its output is compared with the file, by golden_test or by diff.
#include <cstdio>
#include <string>

#include "berth/backend.hpp"
#include "berth/error.hpp"
#include "golden/scenes.hpp"

int main(int argc, char** argv) try {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what != "frames" && what != "network") throw berth::Error("say `frames` or `network`, then a backend or none");
  const auto backend = berth::open_backend(argc > 2 ? argv[2] : "cpu");
  const berth::golden::Scenes scenes = berth::golden::render_scenes(BERTH_SOURCE_DIR);
  const auto lines = what == "frames" ? berth::golden::frame_lines(scenes, *backend, BERTH_SOURCE_DIR)
                                      : berth::golden::network_lines(scenes, *backend, BERTH_SOURCE_DIR);
  std::printf(
      "# What the golden scenes give, to the last bit (docs/arithmetic.md).\n"
      "# Written by: cmake --build --preset release --target golden_file\n");
  for (const std::string& line : lines) std::printf("%s\n", line.c_str());
} catch (const berth::Error& error) {
  return std::fprintf(stderr, "golden_record: %s\n", error.what()), 2;
}
