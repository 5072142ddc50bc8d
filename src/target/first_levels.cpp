#include "target/first_levels.hpp"

#include "target/symmetric.hpp"

namespace berth {
namespace {

// Modules of each tone that must not be saturated: their number, and their share.
constexpr int kLeastModules = 8;
constexpr int kLeastShare = 2;  // one in

/// A plane through grey levels, by least squares.
class Plane {
 public:
  void add(double x, double y, double grey) {
    const double row[3] = {1, x, y};
    for (std::size_t i = 0; i < 3; ++i) {
      sums_[i] += row[i] * grey;
      for (std::size_t j = 0; j <= i; ++j) matrix_[3 * i + j] += row[i] * row[j];
    }
    ++count_;
  }
  bool solve(std::array<double, 3>& plane) const {
    SquareMatrix<3> factor = matrix_;
    if (!factorise<3>(factor, 1e-6)) return false;
    plane = berth::solve<3>(factor, sums_);
    return true;
  }
  int count() const { return count_; }

 private:
  SquareMatrix<3> matrix_ = {};
  std::array<double, 3> sums_ = {};
  int count_ = 0;
};

}  // namespace

bool first_levels(const FitScene& scene, const MarkerMap& map, FitState& state) {
  Plane planes[2];
  int saturated[2] = {0, 0};
  for (int row = scene.cells.first(); row <= scene.cells.last(); ++row) {
    for (int column = scene.cells.first(); column <= scene.cells.last(); ++column) {
      const PatternCell& cell = scene.cells.at(column, row);
      if (cell.kind == PatternCell::kUnknown) continue;
      std::array<double, 4> derivative{};
      const std::array<double, 2> point = map.at(column + 0.5, row + 0.5, derivative);
      if (!(point[0] > 0 && point[0] < scene.image.width - 1 && point[1] > 0 && point[1] < scene.image.height - 1)) {
        continue;
      }
      const int x = static_cast<int>(point[0] + 0.5), y = static_cast<int>(point[1] + 0.5);
      const int grey = scene.image.row(y)[x];
      const int tone = cell.left[1] + cell.middle[1];
      if (grey == 0 || grey == 255) {
        ++saturated[tone];
        continue;
      }
      planes[tone].add((x - state.middle[0]) / state.side_px, (y - state.middle[1]) / state.side_px, grey);
    }
  }
  std::array<std::array<double, 3>, 2> levels{};
  for (std::size_t tone = 0; tone < 2; ++tone) {
    const int count = planes[tone].count();
    if (count < kLeastModules || count < (count + saturated[tone]) / kLeastShare) return false;
    if (!planes[tone].solve(levels[tone])) return false;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    state.dark[k] = levels[0][k];
    state.contrast[k] = levels[1][k] - levels[0][k];
  }
  return true;
}

}  // namespace berth
