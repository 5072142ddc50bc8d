#include "calibration/view_set.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace berth {
namespace {

// Zhang's method needs three; with fewer than ten the distortion rests on single images.
constexpr std::size_t kLeastViews = 10;
// Wider edges (BoardView::edge_px) move corners by more than noise does.
constexpr double kBlurred_px = 5.5;
// Mean shift of the points from an earlier view, as a share of the image's width.
constexpr double kLeastShift = 0.02;
constexpr double kLeastCoverage = 0.6;

std::string percent(double share) { return std::to_string(static_cast<int>(std::lround(100 * share))) + " %"; }

}  // namespace

ViewSet::ViewSet(int width, int height, std::size_t most)
    : width_(width), height_(height), most_(most), fields_(static_cast<std::size_t>(kAcross * kDown)) {}

ViewSet::Verdict ViewSet::add(BoardView view) {
  if (view.edge_px > kBlurred_px) {
    ++blurred_;
    return Verdict::blurred;
  }
  if (is_repeated(view)) return Verdict::repeated;
  if (views_.size() >= most_) return Verdict::full;
  for (const std::array<double, 2>& at : view.seen_px) {
    const int column = std::clamp(static_cast<int>((at[0] + 0.5) * kAcross / width_), 0, kAcross - 1);
    const int row = std::clamp(static_cast<int>((at[1] + 0.5) * kDown / height_), 0, kDown - 1);
    ++fields_[static_cast<std::size_t>(row * kAcross + column)];
  }
  views_.push_back(std::move(view));
  return Verdict::taken;
}

bool ViewSet::is_repeated(const BoardView& view) const {
  std::map<std::size_t, std::array<double, 2>> seen;
  for (std::size_t i = 0; i < view.points.size(); ++i) seen[view.points[i]] = view.seen_px[i];
  return std::any_of(views_.begin(), views_.end(), [&](const BoardView& earlier) {
    double shift = 0;
    int shared = 0;
    for (std::size_t i = 0; i < earlier.points.size(); ++i) {
      const auto found = seen.find(earlier.points[i]);
      if (found == seen.end()) continue;
      shift += std::hypot(found->second[0] - earlier.seen_px[i][0], found->second[1] - earlier.seen_px[i][1]);
      ++shared;
    }
    return shared > 0 && shift < kLeastShift * width_ * shared;
  });
}

double ViewSet::coverage() const {
  const auto filled = std::count_if(fields_.begin(), fields_.end(), [](int points) { return points > 0; });
  return static_cast<double>(filled) / static_cast<double>(fields_.size());
}

// The parts of the image, in thirds, that have more empty fields than others.
std::string ViewSet::empty_parts() const {
  static constexpr const char* kNames[] = {"upper left", "top",        "upper right", "left",       "middle",
                                           "right",      "lower left", "bottom",      "lower right"};
  std::array<int, 9> empty{};
  std::array<int, 9> all{};
  for (int i = 0; i < kAcross * kDown; ++i) {
    const auto part = static_cast<std::size_t>(i / kAcross * 3 / kDown * 3 + i % kAcross * 3 / kAcross);
    ++all[part];
    if (fields_[static_cast<std::size_t>(i)] == 0) ++empty[part];
  }
  std::string names;
  for (std::size_t part = 0; part < 9; ++part) {
    if (2 * empty[part] > all[part]) names += (names.empty() ? "" : ", ") + std::string(kNames[part]);
  }
  return names;
}

std::vector<std::string> ViewSet::objections() const {
  std::vector<std::string> all;
  if (views_.size() < kLeastViews) {
    std::string text = "too few views: " + std::to_string(views_.size()) + " of the " + std::to_string(kLeastViews) +
                       " that are needed";
    if (blurred_ > 0) text += ", and " + std::to_string(blurred_) + " blurred";
    all.push_back(text + "; take about 20, each from another place");
  }
  if (blurred_ > 0 && static_cast<std::size_t>(blurred_) > views_.size()) {
    all.push_back("blur: in " + std::to_string(blurred_) + " views the edges are wider than " +
                  std::to_string(kBlurred_px).substr(0, 3) + " px; focus, hold still, or give more light");
  }
  if (!views_.empty() && coverage() < kLeastCoverage) {
    all.push_back("poor coverage: the board was seen in " + percent(coverage()) + " of the image, " +
                  percent(kLeastCoverage) + " are needed; show it at the " + empty_parts());
  }
  return all;
}

}  // namespace berth
