#include "navset/develop.hpp"

#include <algorithm>
#include <cmath>

#include "navset/parts.hpp"
#include "navset/sample.hpp"

namespace berth::navset {
namespace {

// Between pixels, linearly; outside, the rim repeated.
template <class T>
double value_at(const T* pixels, int width, int height, double x, double y) {
  x = std::min(width - 1.001, std::max(0.0, x));
  y = std::min(height - 1.001, std::max(0.0, y));
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const double fx = x - i, fy = y - j;
  const T* p = pixels + static_cast<std::ptrdiff_t>(j) * width + i;
  return (p[0] * (1 - fx) + p[1] * fx) * (1 - fy) + (p[width] * (1 - fx) + p[width + 1] * fx) * fy;
}

void smear(std::vector<double>& image, int width, int height, double dx, double dy) {
  const double length = std::sqrt(dx * dx + dy * dy);
  if (!(length > 0)) return;
  const int steps = static_cast<int>(length) + 2;
  std::vector<double> sum(image.size(), 0.0);
  for (int k = 0; k < steps; ++k) {
    const double part = static_cast<double>(k) / (steps - 1) - 0.5;
    std::size_t at = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        sum[at++] += value_at(image.data(), width, height, x + part * dx, y + part * dy) / steps;
      }
    }
  }
  image.swap(sum);
}

class ToneCurve {
 public:
  explicit ToneCurve(double gamma) {
    for (int i = 0; i <= kNodes; ++i) nodes_.push_back(255 * exact_pow(static_cast<double>(i) / kNodes, gamma));
    nodes_.push_back(nodes_.back());
  }
  double operator()(double grey) const {
    const double place = std::min(1.0, std::max(0.0, grey / 255)) * kNodes;
    const auto i = static_cast<std::size_t>(place);
    return nodes_[i] + (place - static_cast<double>(i)) * (nodes_[i + 1] - nodes_[i]);
  }

 private:
  static constexpr int kNodes = 256;
  std::vector<double> nodes_;
};

}  // namespace

double metered(const std::vector<double>& radiance) {
  constexpr int kBins = 1024;
  std::vector<long> counts(kBins + 1, 0);
  for (const double value : radiance) ++counts[static_cast<std::size_t>(std::min(2.0, value) * (0.5 * kBins))];
  const auto total = static_cast<long>(radiance.size());
  double sum = 0;
  for (const long share : {total / 10, total / 100}) {
    long above = 0;
    int bin = kBins;
    while (bin > 0 && above + counts[static_cast<std::size_t>(bin)] < share)
      above += counts[static_cast<std::size_t>(bin--)];
    sum += 0.5 * bin * 2 / kBins;
  }
  return sum;
}

Exposure random_exposure(const std::vector<double>& radiance, double dimmest, sim::Random& random) {
  Exposure e;
  e.gain = std::min(4.0, std::max(0.3, log_uniform(random, dimmest, 1.25) / std::max(0.02, metered(radiance))));
  if (random.chance(0.5)) e.gamma = random.uniform(0.7, 1.25);
  e.black_level = random.uniform(0, 10);
  e.blur_sigma_px = log_uniform(random, 0.3, 1.5);
  if (random.chance(0.1)) e.defocus_px = random.uniform(0.5, 2);
  if (random.chance(0.15)) {
    e.smear_x_px = random.uniform(-5, 5);
    e.smear_y_px = random.uniform(-5, 5);
  }
  e.full_well_e = log_uniform(random, 1500, 20000);
  e.read_noise = log_uniform(random, 0.5, 5);
  return e;
}

std::vector<double> cut_backdrop(View2D<const u8> backdrop, bool any_way_up, sim::Random& random) {
  const double angle = any_way_up ? random.uniform(0, 2 * sim::kPi) : random.uniform(-0.15, 0.15);
  const double c = sim::exact_cos(angle), s = sim::exact_sin(angle);
  // The turned window must fit; it is 0.45 to 0.95 of what fits.
  const double fits = (backdrop.width - 2) / (std::abs(c) + std::abs(s));
  const double span = fits * random.uniform(0.45, 0.95),
               slack = (backdrop.width - 2 - span * (std::abs(c) + std::abs(s))) / 2;
  const double middle = (backdrop.width - 1) / 2.0;
  const double x0 = middle + random.uniform(-slack, slack), y0 = middle + random.uniform(-slack, slack);
  const double mirror = random.chance(0.5) ? -1 : 1, step = span / kSide_px;
  const double gain = log_uniform(random, 0.35, 1.2) / 255,
               lift = random.chance(0.3) ? random.uniform(-0.05, 0.12) : 0.0;
  // Finer than a pixel: two by two samples where a pixel covers more than 1.3 of the picture's.
  const int across = step > 1.3 ? 2 : 1;
  std::vector<double> radiance;
  radiance.reserve(static_cast<std::size_t>(kSide_px) * kSide_px);
  for (int y = 0; y < kSide_px; ++y) {
    for (int x = 0; x < kSide_px; ++x) {
      double sum = 0;
      for (int k = 0; k < across * across; ++k) {
        const int column = k % across, row = k / across;
        const double u = mirror * step * (x + (column + 0.5) / across - kSide_px / 2.0);
        const double v = step * (y + (row + 0.5) / across - kSide_px / 2.0);
        sum += value_at(backdrop.data, backdrop.width, backdrop.height, x0 + c * u - s * v, y0 + s * u + c * v);
      }
      radiance.push_back(std::max(0.0, lift + gain * sum / (across * across)));
    }
  }
  return radiance;
}

void develop(std::vector<double>& radiance, const Exposure& e, const sim::SensorModel& sensor, u64 noise_seed,
             View2D<u8> image) {
  const int width = image.width, height = image.height;
  // A full pixel holds no more: highlights spread by the blur, but not without bound.
  for (double& value : radiance) value = std::min(4.0, value);
  smear(radiance, width, height, e.smear_x_px, e.smear_y_px);
  sim::disc_blur(radiance, width, height, e.defocus_px);
  sim::gaussian_blur(radiance, width, height, e.blur_sigma_px);
  const ToneCurve tone(e.gamma);
  const double scale = (255 - e.black_level) * e.gain, shot = 255 / e.full_well_e;
  const double read_variance = e.read_noise * e.read_noise;
  const u64 key = sim::scatter(noise_seed);
  std::size_t at = 0;
  for (int y = 0; y < height; ++y) {
    u8* out = image.row(y);
    for (int x = 0; x < width; ++x, ++at) {
      const double signal = scale * radiance[at];
      double grey = e.black_level + (e.gamma == 1 ? signal : tone(signal));
      grey += std::sqrt(std::min(255.0, signal) * shot + read_variance) * sensor.normal(sim::scatter(key ^ at));
      out[x] = static_cast<u8>(grey <= 0 ? 0 : grey >= 254.5 ? 255 : static_cast<int>(grey + 0.5));
    }
  }
}

bool black(View2D<const u8> image) {
  long lit = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) lit += image.at(x, y) >= 20 ? 1 : 0;
  }
  return lit * 100 < static_cast<long>(image.width) * image.height;
}

}  // namespace berth::navset
