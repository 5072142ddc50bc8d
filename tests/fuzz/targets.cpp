#include "fuzz/targets.hpp"

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
      {"image_file", image_file, {"tests/data/tag36h11_7.png"}},
      {"camera_pixels", camera_pixels, {}},
      {"marker_frame", marker_frame, {}, 120},
  };
  return all;
}

}  // namespace berth::fuzz
