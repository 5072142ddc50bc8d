#include "health/known_answer.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "berth/backend.hpp"
#include "frame/digest.hpp"
#include "frame/result_digest.hpp"
#include "frame/window.hpp"
#include "target/marker_pattern.hpp"

namespace berth {
namespace {

constexpr u8 kDark = 40, kLight = 210, kBackground = 130;
/// Modules of so many pixels in turn: what is searched in the whole image, and what in the halved one.
constexpr std::array<int, 4> kModulePx = {4, 7, 3, 5};
/// Pixels that a marker leans to the right over 16 rows.
constexpr std::array<int, 5> kLeans = {0, 2, -1, 3, -2};

/// The next of Knuth's MMIX numbers; their high bits are the better ones.
u32 next_random(u64& state) {
  state = state * 6364136223846793005u + 1442695040888963407u;
  return static_cast<u32>(state >> 40);
}

/// Where markers go, row by row from the upper left.
struct Shelf {
  int x = 0, y = 0, height = 0;

  /// Whether there is room, where x and y then are.
  bool place(const GrayImage& image, int width, int rows) {
    const bool goes_on = x + width <= image.width();
    const int at_y = goes_on ? y : y + height;
    if (width > image.width() || at_y + rows > image.height()) return false;
    if (!goes_on) x = 0;
    y = at_y;
    height = goes_on ? std::max(height, rows) : rows;
    return true;
  }
};

/// With a light margin of one module, or a dark one about a border that is light inside.
void draw(const MarkerFamily& family, int id, int module_px, int lean, int x0, int y0, GrayImage& image) {
  const std::vector<u8> pattern = marker_pattern(family, id);
  const int modules = family.total_width + 2;
  const int side = modules * module_px;
  const int first = lean < 0 ? -lean * side / 16 : 0;
  for (int y = 0; y < side; ++y) {
    u8* const row = image.view().row(y0 + y) + x0 + first + lean * y / 16;
    for (int x = 0; x < side; ++x) {
      const int column = x / module_px - 1, line = y / module_px - 1;
      const bool is_margin = column < 0 || line < 0 || column >= family.total_width || line >= family.total_width;
      const bool is_light = is_margin ? !family.reversed_border
                                      : pattern[static_cast<std::size_t>(line * family.total_width + column)] != 0;
      row[x] = is_light ? kLight : kDark;
    }
  }
}

/// As a lens and a sensor would: edges a pixel wide, and noise.
void soften(GrayImage& image, u64& random) {
  const View2D<u8> view = image.view();
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const int right = std::min(x + 1, view.width - 1), below = std::min(y + 1, view.height - 1);
      const int sum = view.at(x, y) + view.at(right, y) + view.at(x, below) + view.at(right, below);
      view.at(x, y) = static_cast<u8>(sum / 4 + static_cast<int>(next_random(random) % 5) - 2);
    }
  }
}

/// All windows of each side there is, here and there in the picture.
std::vector<std::vector<SearchWindow>> window_parts(int width, int height, const std::vector<int>& sides) {
  std::vector<std::vector<SearchWindow>> parts;
  for (const int side : sides) {
    auto part = std::find_if(parts.begin(), parts.end(), [side](const auto& one) { return one.front().side == side; });
    if (part == parts.end()) part = parts.insert(parts.end(), std::vector<SearchWindow>());
    const int k = static_cast<int>(part->size()) + static_cast<int>(part - parts.begin());
    const auto place = [&](int length, int stride) {
      return stride * k % ((length - side) / kWindowStep + 1) * kWindowStep;
    };
    part->push_back({side, place(width, 7), place(height, 5)});
  }
  return parts;
}

}  // namespace

GrayImage known_picture(int width, int height, const std::vector<std::string>& families) {
  GrayImage image(width, height);
  const View2D<u8> view = image.view();
  for (int y = 0; y < height; ++y) std::fill_n(view.row(y), width, kBackground);
  Shelf shelf;
  // Until nothing of any family and size has room.
  for (std::size_t i = 0, misses = 0; misses < kModulePx.size() * families.size(); ++i) {
    const MarkerFamily& one = family(families[i % families.size()]);
    const int id = static_cast<int>(i * 7 % one.codes.size());
    const int module_px = kModulePx[i / families.size() % kModulePx.size()];
    const int lean = kLeans[i % kLeans.size()];
    const int side = (one.total_width + 2) * module_px;
    const int leaning = (lean < 0 ? -lean : lean) * side / 16 + 1;
    if (!shelf.place(image, side + leaning + module_px, side + module_px)) {
      ++misses;
      continue;
    }
    misses = 0;
    draw(one, id, module_px, lean, shelf.x, shelf.y, image);
    shelf.x += side + leaning + module_px;
  }
  u64 random = 2026;
  soften(image, random);
  return image;
}

KnownAnswer::KnownAnswer(int width, int height, const DetectorConfig& config)
    : image_(known_picture(width, height, config.families)) {
  const std::unique_ptr<Backend> reference = open_backend("reference");
  Detector detector(*reference, width, height, config);
  parts_.emplace_back();
  for (std::vector<SearchWindow>& windows : window_parts(width, height, config.window_sides)) {
    parts_.push_back({windows, 0});
    for (SearchWindow& window : windows) window.full_resolution_only = true;
    parts_.push_back({std::move(windows), 0});
  }
  for (Part& part : parts_) part.expected = digest(detector.detect(image_.view(), {}, part.windows));
}

u64 KnownAnswer::digest(const FrameResult& result) {
  u64 digest = digest_of(result);
  const u32 quads = static_cast<u32>(result.quads);
  digest = digest_words(&quads, 1, digest);
  for (const CapacityUse& use : result.capacities) digest = digest_words(&use.needed, 1, digest);
  for (const Detection& d : result.detections) {
    const u32 hamming = static_cast<u32>(d.hamming);
    digest = digest_words(&hamming, 1, digest);
    digest = digest_number(d.margin, digest);
    if (d.corner_covariance_px2) {
      for (const double value : *d.corner_covariance_px2) digest = digest_number(value, digest);
    }
    if (d.pose_uncertainty) {
      for (const double value : d.pose_uncertainty->covariance) digest = digest_number(value, digest);
    }
  }
  return digest;
}

}  // namespace berth
