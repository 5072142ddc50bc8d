#include "fuzz/targets.hpp"

#include <cstring>

namespace berth::fuzz {

const std::vector<Target>& targets() {
  static const std::vector<Target> all = {
      {"camera_file", camera_file, {}},
      {"bundle_file", bundle_file, {"bundles/*.yaml"}},
      {"disc_target_file", disc_target_file, {"targets/*.yaml"}},
      {"scenario_file", scenario_file, {"scenarios/*.toml"}, 24},
      {"machine_file", machine_file, {"bench/machines/*.toml"}},
      {"network_file", network_file, {"training/tests/data/tiny.berthnet"}},
      {"recording_file", recording_file, {}},
      {"recorded_text", recorded_text, {}},
      {"recorded_image", recorded_image, {}},
      {"source_options", source_options, {}},
      {"image_file", image_file, {"tests/data/tag36h11_7.png"}},
      {"camera_pixels", camera_pixels, {}},
      {"marker_frame", marker_frame, {}, 120},
  };
  return all;
}

const Target* find_target(const char* name) {
  for (const Target& target : targets()) {
    if (std::strcmp(target.name, name) == 0) return &target;
  }
  return nullptr;
}

}  // namespace berth::fuzz
