#include "sim/sensor.hpp"

#include <algorithm>
#include <cmath>

#include "exact_math.hpp"
#include "sim/random.hpp"

namespace berth::sim {
namespace {

int clamped(int i, int count) { return std::min(count - 1, std::max(0, i)); }

std::size_t row_start(int y, int width) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width); }

// A tone curve as a table: exact at its nodes, linear between; a millionth of a grey level off except near black.
class ToneCurve {
 public:
  explicit ToneCurve(double gamma) : linear_(gamma == 1) {
    if (linear_) return;
    // Nodes evenly spaced in the square root, because the curve may be steep at black.
    for (int i = 0; i <= kNodes; ++i) {
      const double root = static_cast<double>(i) / kNodes;
      nodes_.push_back(255 * exact_pow(root * root, gamma));
    }
    nodes_.push_back(nodes_.back());
  }
  double operator()(double grey) const {
    if (linear_) return grey;
    const double place = std::sqrt(std::min(1.0, std::max(0.0, grey / 255))) * kNodes;
    const auto i = static_cast<std::size_t>(place);
    return nodes_[i] + (place - static_cast<double>(i)) * (nodes_[i + 1] - nodes_[i]);
  }

 private:
  static constexpr int kNodes = 4096;
  bool linear_;
  std::vector<double> nodes_;
};

}  // namespace

void gaussian_blur(std::vector<double>& image, int width, int height, double sigma_px) {
  if (!(sigma_px > 0)) return;
  // Each tap is the Gaussian's value at the pixel's distance: beyond four sigma nothing is left for 8 bits.
  const int radius = static_cast<int>(4 * sigma_px) + 1;
  std::vector<double> taps(static_cast<std::size_t>(radius) + 1);
  double sum = 0;
  for (int i = 0; i <= radius; ++i) {
    taps[static_cast<std::size_t>(i)] = exact_exp(-0.5 * i * i / (sigma_px * sigma_px));
    sum += (i == 0 ? 1 : 2) * taps[static_cast<std::size_t>(i)];
  }
  for (double& tap : taps) tap /= sum;

  std::vector<double> padded(static_cast<std::size_t>(width + 2 * radius));
  for (int y = 0; y < height; ++y) {
    double* row = image.data() + row_start(y, width);
    for (int x = -radius; x < width + radius; ++x) {
      padded[static_cast<std::size_t>(x + radius)] = row[clamped(x, width)];
    }
    const double* middle = padded.data() + radius;
    for (int x = 0; x < width; ++x) row[x] = taps[0] * middle[x];
    for (int i = 1; i <= radius; ++i) {
      const double tap = taps[static_cast<std::size_t>(i)];
      for (int x = 0; x < width; ++x) row[x] += tap * (middle[x - i] + middle[x + i]);
    }
  }
  std::vector<double> result(image.size());
  for (int y = 0; y < height; ++y) {
    double* row = result.data() + row_start(y, width);
    const double* middle = image.data() + row_start(y, width);
    for (int x = 0; x < width; ++x) row[x] = taps[0] * middle[x];
    for (int i = 1; i <= radius; ++i) {
      const double tap = taps[static_cast<std::size_t>(i)];
      const double* above = image.data() + row_start(clamped(y - i, height), width);
      const double* below = image.data() + row_start(clamped(y + i, height), width);
      for (int x = 0; x < width; ++x) row[x] += tap * (above[x] + below[x]);
    }
  }
  image.swap(result);
}

void disc_blur(std::vector<double>& image, int width, int height, double radius_px) {
  if (!(radius_px > 0)) return;
  // A pixel's weight is the share of its 8 × 8 points inside the disc.
  struct Tap {
    int dx, dy;
    double weight;
  };
  std::vector<Tap> taps;
  int points = 0;
  const int reach = static_cast<int>(radius_px + 0.5) + 1;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      int inside = 0;
      for (int i = 0; i < 64; ++i) {
        const int column = i % 8, row = i / 8;
        const double x = dx + (column - 3.5) / 8, y = dy + (row - 3.5) / 8;
        if (x * x + y * y <= radius_px * radius_px) ++inside;
      }
      if (inside > 0) taps.push_back({dx, dy, static_cast<double>(inside)});
      points += inside;
    }
  }
  if (points == 0) return;
  std::vector<double> result(image.size());
  for (int y = 0; y < height; ++y) {
    double* out = result.data() + row_start(y, width);
    for (const Tap& tap : taps) {
      const double weight = tap.weight / points;
      const double* row = image.data() + row_start(clamped(y + tap.dy, height), width);
      const int first = std::min(width, std::max(0, -tap.dx)), last = std::max(first, std::min(width, width - tap.dx));
      for (int x = 0; x < first; ++x) out[x] += weight * row[clamped(x + tap.dx, width)];
      for (int x = first; x < last; ++x) out[x] += weight * row[x + tap.dx];
      for (int x = last; x < width; ++x) out[x] += weight * row[clamped(x + tap.dx, width)];
    }
  }
  image.swap(result);
}

SensorModel::SensorModel() {
  for (int i = 0; i <= kCells; ++i) quantiles_.push_back(normal_quantile(static_cast<double>(i) / kCells));
}

double SensorModel::normal(u64 bits) const {
  const auto cell = static_cast<int>(bits >> 52);
  // The steep ends are computed; between, the table's chords are off by less than 0.01.
  if (cell < 8 || cell >= kCells - 8)
    return normal_quantile((static_cast<double>(bits >> 12) + 0.5) / 4503599627370496.0);
  const double part = static_cast<double>((bits >> 20) & 0xffffffffu) * (1.0 / 4294967296.0);
  const double low = quantiles_[static_cast<std::size_t>(cell)], high = quantiles_[static_cast<std::size_t>(cell) + 1];
  return low + part * (high - low);
}

GrayImage SensorModel::expose(const Sensor& sensor, const RayMap& rays, std::vector<double> radiance, u64 seed) const {
  const int width = rays.camera().width, height = rays.camera().height;
  if (sensor.vignetting > 0) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Vec2& ray = rays.corner(x, y);  // half a pixel off: nothing to such a slow field
        const double cos2 = 1 / (1 + ray[0] * ray[0] + ray[1] * ray[1]);
        radiance[row_start(y, width) + static_cast<std::size_t>(x)] *= 1 + sensor.vignetting * (cos2 * cos2 - 1);
      }
    }
  }
  disc_blur(radiance, width, height, sensor.defocus_px);
  gaussian_blur(radiance, width, height, sensor.blur_sigma_px);

  const ToneCurve tone(sensor.gamma);
  const double range = sensor.white_level - sensor.black_level;
  // Variance of the shot noise, grey levels squared, per grey level above black.
  const double shot = sensor.full_well_e > 0 ? 255 / sensor.full_well_e : 0;
  const double read_variance = sensor.read_noise * sensor.read_noise;
  const u64 key = scatter(seed);
  GrayImage image(width, height);
  for (int y = 0; y < height; ++y) {
    u8* out = image.view().row(y);
    for (int x = 0; x < width; ++x) {
      const std::size_t at = row_start(y, width) + static_cast<std::size_t>(x);
      const double signal = range * radiance[at];
      const u64 bits = scatter(key ^ scatter(at));
      double grey = sensor.black_level + signal;
      if (sensor.gamma == 1) {
        // Two independent normal numbers add up to one.
        const double variance = std::max(0.0, signal) * shot + read_variance;
        if (variance > 0) grey += std::sqrt(variance) * normal(bits);
      } else {
        if (shot > 0 && signal > 0) grey += std::sqrt(signal * shot) * normal(bits);
        grey = tone(grey);
        if (sensor.read_noise > 0) grey += sensor.read_noise * normal(scatter(bits));
      }
      out[x] = static_cast<u8>(grey <= 0 ? 0 : grey >= 254.5 ? 255 : static_cast<int>(grey + 0.5));
    }
  }
  return image;
}

}  // namespace berth::sim
