#include <algorithm>
#include <array>
#include <cstdlib>
#include <vector>

#include "reference/arithmetic.hpp"
#include "reference/reference.hpp"

namespace berth::reference {
namespace {

struct Point {
  std::int64_t x, y;
};

std::int64_t cross(Point a, Point b, Point c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }
std::int64_t square_distance(Point a, Point b) { return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y); }

/// One contour's way from points to four sides; the steps are those at the top of kernels/quad_fit.inl.
class QuadFit {
 public:
  QuadFit(const quad_fit_params& p, const u32* points, int count, bool hole)
      : p_(p), points_(points), count_(count), turn_(hole ? -1 : 1) {}

  /// Writes the quadrilateral's words; returns false (and leaves them) when the contour is none.
  bool fit(s32* quad) {
    measure_extent();
    if (is_at_border() || !find_vertices()) return false;
    if (!judge()) {
      if (!polish() || !judge()) return false;
    }
    std::array<LineFit, 4> lines;
    for (int k = 0; k < 4; ++k) {
      lines[static_cast<std::size_t>(k)] = side_line(k);
      const LineFit& line = lines[static_cast<std::size_t>(k)];
      if (line.points() < 3 || line.spread() <= 0) return false;
    }
    quad[1] = count_;
    quad[2] = static_cast<s32>(area_ * turn_);
    quad[3] = shortest_;
    for (int k = 0; k < 4; ++k)
      write_side(k, lines[static_cast<std::size_t>(k)], quad + QUAD_SIDE + k * QUAD_SIDE_WORDS);
    return true;
  }

 private:
  /// The row's centre for y.
  Point at(int i) const {
    const u32 word = points_[i % count_];
    return {static_cast<std::int64_t>(word & 0xffffu), static_cast<std::int64_t>((word >> 16) | 1u)};
  }
  bool is_end(int i) const { return ((points_[i % count_] >> 16) & 1u) != 0; }
  /// The row boundary that the walk crosses (or follows) after point i.
  std::int64_t boundary_after(int i) const {
    const std::int64_t y = points_[i % count_] >> 16;
    return is_end(i) ? y + 1 : y;
  }

  void measure_extent() {
    low_ = high_ = at(0);
    for (int i = 0; i < count_; ++i) {
      const Point point = at(i);
      low_ = {std::min(low_.x, point.x), std::min(low_.y, point.y)};
      high_ = {std::max(high_.x, point.x), std::max(high_.y, point.y)};
      area_ += is_end(i) ? point.x / 2 : -(point.x / 2);
    }
  }

  bool is_at_border() const {
    return low_.x < p_.margin * 2 || low_.y < p_.margin * 2 || high_.x > (p_.max_width - p_.margin) * 2 ||
           high_.y > (p_.max_height - p_.margin) * 2;
  }

  int farthest_from(Point point) const {
    int best = 0;
    for (int i = 1; i < count_; ++i) {
      if (square_distance(at(i), point) > square_distance(at(best), point)) best = i;
    }
    return best;
  }

  /// The first index between two vertices that is farthest from their chord, and its height; -1 when all lie on it.
  struct Apex {
    int index;
    int height_q4;
  };
  Apex apex(int from, int to) const {
    int best = -1;
    std::int64_t most = 0;
    for (int i = from + 1; i < to; ++i) {
      const std::int64_t distance = std::abs(cross(at(from), at(to), at(i)));
      if (distance > most) {
        most = distance;
        best = i;
      }
    }
    const std::int64_t length = std::max(square_root(square_distance(at(from), at(to))), 1);
    return {best, static_cast<int>(most / length * 16 + most % length * 16 / length)};
  }

  bool find_vertices() {
    const int a = farthest_from({(low_.x + high_.x) / 2, (low_.y + high_.y) / 2});
    const int c = farthest_from(at(a));
    if (a == c) return false;
    vertices_ = {std::min(a, c), std::max(a, c)};
    for (int round = 0; round < 2; ++round) {
      std::size_t split = 0;
      Apex highest = {-1, -1};
      for (std::size_t k = 0; k < vertices_.size(); ++k) {
        const Apex here = apex(vertices_[k], end_of_arc(k));
        if (here.height_q4 > highest.height_q4) {
          highest = here;
          split = k;
        }
      }
      if (highest.index < 0) return false;
      vertices_.insert(vertices_.begin() + static_cast<std::ptrdiff_t>(split) + 1, highest.index);
    }
    return true;
  }

  int end_of_arc(std::size_t k) const { return k + 1 < vertices_.size() ? vertices_[k + 1] : vertices_[0] + count_; }

  bool judge() {
    std::int64_t polygon = 0;  // twice the area in half pixels squared
    bool good = true;
    shortest_ = 1 << 30;
    for (std::size_t k = 0; k < 4; ++k) {
      const Point a = at(vertices_[k]);
      const Point b = at(end_of_arc(k));
      polygon += cross(at(vertices_[0]), a, b);
      const int length = square_root(square_distance(a, b));
      shortest_ = std::min(shortest_, length);
      if (length < p_.min_side_px * 2) good = false;
      if (apex(vertices_[k], end_of_arc(k)).height_q4 > 51 + length * 4 / 5) good = false;
    }
    const std::int64_t contour = area_ * turn_ * 8;
    const std::int64_t slack = contour / 10 * 3 + (high_.x - low_.x) * 8;
    return good && polygon * turn_ > 0 && std::abs(polygon * turn_ - contour) <= slack;
  }

  bool polish() {
    for (int round = 0; round < 3; ++round) {
      for (std::size_t k = 0; k < 4; ++k) {
        const int from = vertices_[(k + 3) % 4];
        int to = vertices_[(k + 1) % 4];
        if (to <= from) to += count_;
        const int moved = apex(from, to).index;
        if (moved >= 0) vertices_[k] = moved % count_;
      }
    }
    std::rotate(vertices_.begin(), std::min_element(vertices_.begin(), vertices_.end()), vertices_.end());
    for (std::size_t k = 0; k < 3; ++k) {
      if (vertices_[k] >= vertices_[k + 1]) return false;
    }
    return true;
  }

  struct Side {
    bool upright;
    int u_from, u_to, u_middle, v_middle, length, halvings;
  };
  Side side(int k) const {
    const Point a = at(vertices_[static_cast<std::size_t>(k)]);
    const Point b = at(end_of_arc(static_cast<std::size_t>(k)));
    Side s{};
    s.upright = std::abs(b.y - a.y) >= std::abs(b.x - a.x);
    s.u_from = static_cast<int>(s.upright ? a.y : a.x);
    s.u_to = static_cast<int>(s.upright ? b.y : b.x);
    s.u_middle = (s.u_from + s.u_to) / 2;
    s.v_middle = static_cast<int>(s.upright ? (a.x + b.x) / 2 : (a.y + b.y) / 2);
    s.length = std::abs(s.u_to - s.u_from);
    s.halvings = side_halvings(s.length);
    return s;
  }

  LineFit side_line(int k) const {
    const Side s = side(k);
    const int trim = side_trim(s.length);
    const int first = std::min(s.u_from, s.u_to) + trim;
    const int last = std::max(s.u_from, s.u_to) - trim;
    LineFit line;
    const auto add = [&](std::int64_t u, std::int64_t v) {
      if (u >= first && u <= last) {
        line.add(LineFit::floor_shift(u - s.u_middle, s.halvings), LineFit::floor_shift(v - s.v_middle, s.halvings));
      }
    };
    const int from = vertices_[static_cast<std::size_t>(k)];
    const int to = end_of_arc(static_cast<std::size_t>(k));
    if (s.upright) {
      for (int i = from; i <= to; ++i) add(at(i).y, at(i).x);
      return line;
    }
    const bool rightward = s.u_to > s.u_from;
    for (int i = from; i < to; ++i) {
      if ((at(i + 1).x > at(i).x) != rightward) continue;  // noise that runs back
      for (std::int64_t x = std::min(at(i).x, at(i + 1).x) + 1; x < std::max(at(i).x, at(i + 1).x); x += 2) {
        add(x, boundary_after(i));
      }
    }
    return line;
  }

  void write_side(int k, const LineFit& line, s32* words) const {
    const Side s = side(k);
    const int slope = line.slope(14, 2);
    words[0] = (s.upright ? 0 : 1) + 2 * (s.u_middle + static_cast<int>(line.mean_u()) * (1 << s.halvings));
    words[1] = s.v_middle * 256 + line.value_q8(slope, 14) * (1 << s.halvings);
    words[2] = slope;
    words[3] = s.u_from;
    words[4] = s.u_to;
  }

  const quad_fit_params& p_;
  const u32* points_;
  int count_;
  int turn_;
  Point low_{}, high_{};
  std::int64_t area_ = 0;
  std::vector<int> vertices_;
  int shortest_ = 0;
};

}  // namespace

void quad_fit(const quad_fit_params& p, const u32* contours, const u32* points, s32* quads) {
  for (int slot = 0; slot < p.max_contours; ++slot) {
    const u32* record = contours + CONTOUR_HEADER + slot * CONTOUR_WORDS;
    const int count = static_cast<int>(record[1] & ~CONTOUR_HOLE);
    const bool hole = (record[1] & CONTOUR_HOLE) != 0;
    s32* quad = quads + slot * QUAD_WORDS;
    quad[0] = 0;
    if (count >= 8 && QuadFit(p, points + record[3], count, hole).fit(quad)) {
      quad[0] = hole ? QUAD_VALID | QUAD_HOLE : QUAD_VALID;
    }
  }
}

}  // namespace berth::reference
