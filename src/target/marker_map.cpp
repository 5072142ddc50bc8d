#include "target/marker_map.hpp"

namespace berth {

bool MarkerMap::set(const LensBlocks& lens, const Corners& corners, double border, double reach) {
  lens_ = &lens;
  Corners on_plane;
  for (std::size_t i = 0; i < 4; ++i) on_plane[i] = lens.ray(corners[i]);
  if (!rays_.set(on_plane, border, reach)) return false;
  const QuadMap& m = rays_;
  // The adjugate: inverse up to a factor, which the quotients lose.
  back_ = {{{m.by - m.cy * m.hz, m.cx * m.hz - m.bx, m.bx * m.cy - m.cx * m.by},
            {m.cy * m.gz - m.ay, m.ax - m.cx * m.gz, m.cx * m.ay - m.ax * m.cy},
            {m.ay * m.hz - m.by * m.gz, m.bx * m.gz - m.ax * m.hz, m.ax * m.by - m.bx * m.ay}}};
  return true;
}

std::array<double, 2> MarkerMap::at(double u, double v, std::array<double, 4>& derivative) const {
  const QuadMap& m = rays_;
  const double scale = 1 / (m.gz * u + m.hz * v + 1);
  const double x = (m.ax * u + m.bx * v + m.cx) * scale, y = (m.ay * u + m.by * v + m.cy) * scale;
  const double xu = (m.ax - x * m.gz) * scale, xv = (m.bx - x * m.hz) * scale;
  const double yu = (m.ay - y * m.gz) * scale, yv = (m.by - y * m.hz) * scale;
  std::array<double, 4> lens{};
  const std::array<double, 2> point = lens_->pixel({x, y}, lens);
  derivative = {lens[0] * xu + lens[1] * yu, lens[0] * xv + lens[1] * yv, lens[2] * xu + lens[3] * yu,
                lens[2] * xv + lens[3] * yv};
  return point;
}

}  // namespace berth
