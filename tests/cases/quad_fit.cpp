#include <cstring>

#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

namespace {

/// A closed walk along the outline of a dark polygon (convex or not), as contour_trace writes it: one image, one slot.
OpCase outline(const std::string& name, const GrayImage& image) {
  DetectorConfig config;
  config.capacities.contours = 3;
  return cases_from_frame(name, Op::quad_fit, image.view(), config).front();
}

/// A dark triangle, disc or bar: shapes that are nearly, but not, quadrilaterals.
GrayImage shape(int kind, int size) {
  GrayImage image = pictures::uniform(size + 16, size + 16, 220);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const int dx = 2 * x - size;
      const int dy = 2 * y - size;
      const bool dark = kind == 0 ? x <= y : kind == 1 ? dx * dx + dy * dy <= size * size : 8 * y < size;
      if (dark) image.view().at(x + 8, y + 8) = 20;
    }
  }
  return image;
}

}  // namespace

std::vector<OpCase> quad_fit_cases() {
  std::vector<OpCase> cases = frame_cases(Op::quad_fit);
  for (const int size : {9, 40, 150, 700}) {
    cases.push_back(outline("triangle_" + std::to_string(size), shape(0, size)));
    cases.push_back(outline("disc_" + std::to_string(size), shape(1, size)));
    cases.push_back(outline("bar_" + std::to_string(size), shape(2, size)));
  }
  // Outlines end at cracks 8 and size + 8 of size + 16: kept with a margin of 8 px, left out with one of 9.
  for (const int margin : {8, 9}) {
    cases.push_back(outline("bar_margin_" + std::to_string(margin), shape(2, 40)));
    quad_fit_params params;
    std::memcpy(&params, cases.back().params.data(), sizeof params);
    params.margin = margin;
    std::memcpy(cases.back().params.data(), &params, sizeof params);
  }
  return cases;
}

}  // namespace berth::cases
