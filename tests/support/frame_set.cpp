#include "support/frame_set.hpp"

#include <utility>

#include "support/pictures.hpp"

namespace berth::pictures {

std::vector<Frame> frame_set() {
  DetectorConfig outlines;
  DetectorConfig both;
  both.families = {"tag36h11", "tagStandard41h12"};
  DetectorConfig corrected = both;
  corrected.flat_field.resize(97 * 61);
  Random random(5);
  for (float& gain : corrected.flat_field) gain = 0.5F + static_cast<float>(random.below(256)) / 128.0F;
  DetectorConfig few_runs = both;
  few_runs.capacities.run_ends = 1024;
  DetectorConfig few_contours = both;
  few_contours.capacities.contours = 7;
  DetectorConfig few_points = both;
  few_points.capacities.points = 500;

  std::vector<Frame> frames;
  frames.push_back({"one_pixel", uniform(1, 1, 77), outlines});
  frames.push_back({"one_row", noise(200, 1, {10, 240}, 2), both});
  frames.push_back({"one_column", noise(1, 150, {10, 240}, 3), both});
  frames.push_back({"past_a_word", quads(33, 17, 3, 0, 4), both});
  frames.push_back({"flat", uniform(64, 32, 128), both});
  frames.push_back({"decision_points", noise(129, 67, {100, 104, 105, 106, 110, 119, 120, 121}, 6), both});
  frames.push_back({"extremes", noise(160, 96, {0, 1, 254, 255}, 7), both});
  frames.push_back({"checkerboard", checkerboard(130, 70, 1), both});
  frames.push_back({"coarse_checkerboard", checkerboard(256, 200, 9), both});
  frames.push_back({"outlines", quads(320, 240, 12, 3, 8), outlines});
  frames.push_back({"outlines_and_holes", quads(417, 263, 20, 10, 9), both});
  frames.push_back({"large_quads", quads(1000, 900, 3, 4, 10), both});
  frames.push_back({"mazes", mazes(300, 200, 11), both});
  frames.push_back({"flat_field", quads(97, 61, 4, 2, 12), corrected});
  frames.push_back({"few_runs", mazes(200, 160, 13), few_runs});
  frames.push_back({"few_contours", quads(300, 220, 25, 2, 14), few_contours});
  frames.push_back({"few_points", quads(300, 220, 25, 2, 15), few_points});
  return frames;
}

}  // namespace berth::pictures
