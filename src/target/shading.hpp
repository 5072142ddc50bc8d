#pragma once

#include <array>

#include "berth/image.hpp"
#include "target/layout.hpp"
#include "target/quad_map.hpp"

namespace berth {

/// What white and black look like at one place of a marker, grey levels.
struct Tones {
  double dark, light;
};

/// Tones from a plane through each of the border's rings: averages much noise, follows a gradient.
class PlaneShading {
 public:
  /// Returns false when there is no border to be seen.
  bool fit(View2D<const u8> image, const QuadMap& map, const Layout& layout);

  Tones at(double u, double v) const {
    u -= middle_;
    v -= middle_;
    return {dark_[0] + dark_[1] * u + dark_[2] * v, light_[0] + light_[1] * u + light_[2] * v};
  }
  /// Half the difference of the tones at the centre; > 0.
  double half_contrast() const { return (light_[0] - dark_[0]) / 2; }
  /// Standard deviation of the rings about their planes, relative to half_contrast.
  double misfit() const { return misfit_; }

 private:
  double middle_ = 0;
  std::array<double, 3> dark_, light_;
  double misfit_ = 0;
};

/// Tones blended from the four sides of each ring (a Coons patch): follows the edge of a shadow or of a glare, but
/// takes the noise of single samples with it. Needs the whole border in the image.
class EdgeShading {
 public:
  bool fit(View2D<const u8> image, const QuadMap& map, const Layout& layout);
  Tones at(double u, double v) const;
  double half_contrast() const { return half_contrast_; }

 private:
  static constexpr int kMaxBorder = 16;
  // One ring: a tone for every module of its left, right, upper and lower side, and where the ring is.
  struct Ring {
    std::array<std::array<double, kMaxBorder>, 4> side;
    double first, last;
  };
  double blend(const Ring& ring, double u, double v) const;

  int border_width_ = 0;
  Ring dark_, light_;
  double half_contrast_ = 0;
};

}  // namespace berth
