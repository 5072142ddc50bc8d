#include "calibration_show.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "svg_panel.hpp"

namespace berth::cli {
namespace {

constexpr int kBar = 20;

/// A round number of pixels that holds most residuals.
double residual_scale_px(const Calibration& calibration) {
  double scale = 0.01;
  for (const double next : {0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0}) {
    if (scale < 3 * calibration.rms_px) scale = next;
  }
  return scale;
}

}  // namespace

std::string coverage_bar(const ViewSet& set) {
  const auto full = static_cast<std::size_t>(std::lround(kBar * set.coverage()));
  return fmt::format("[{}{}] {:.0f} %", std::string(full, '#'), std::string(kBar - full, '-'), 100 * set.coverage());
}

std::vector<std::string> coverage_map(const ViewSet& set) {
  std::vector<std::string> rows;
  for (int row = 0; row < ViewSet::kDown; ++row) {
    std::string text = "  ";
    for (int column = 0; column < ViewSet::kAcross; ++column) {
      const int points = set.fields()[static_cast<std::size_t>(row * ViewSet::kAcross + column)];
      text += points == 0 ? " ." : points < 5 ? " -" : points < 20 ? " +" : " #";
    }
    rows.push_back(text);
  }
  return rows;
}

std::string calibration_text(const Calibration& calibration, const ViewSet& set) {
  const std::vector<std::string> names = parameter_names(calibration.camera.lens);
  const std::vector<double> values = parameters(calibration.camera);
  std::string text = fmt::format("{:<4}{:>14}   {}\n", "", "value", "standard deviation");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool pixels = i < 4;
    text += fmt::format("{:<4}{:>14.{}f}   {:.{}f}{}\n", names[i], values[i], pixels ? 3 : 6, calibration.deviations[i],
                        pixels ? 3 : 6, pixels ? " px" : "");
  }
  std::size_t worst = 0;
  for (std::size_t v = 1; v < calibration.views.size(); ++v) {
    if (calibration.views[v].rms_px > calibration.views[worst].rms_px) worst = v;
  }
  text += fmt::format("residuals {:.3f} px RMS; worst view {} with {:.3f} px; boards lean up to {:.0f} degrees apart\n",
                      calibration.rms_px, set.views()[worst].label, calibration.views[worst].rms_px,
                      calibration.tilt_range_deg());
  return text;
}

nlohmann::ordered_json calibration_json(const Calibration& calibration, const ViewSet& set, const Board& board) {
  using nlohmann::ordered_json;
  const CameraModel& camera = calibration.camera;
  const std::vector<std::string> names = parameter_names(camera.lens);
  const std::vector<double> values = parameters(camera);
  ordered_json result = {
      {"board", board.describe()},    {"width", camera.width},
      {"height", camera.height},      {"model", camera.lens == LensModel::equidistant ? "equidistant" : "plumb_bob"},
      {"rms_px", calibration.rms_px}, {"coverage", set.coverage()},
      {"blurred", set.blurred()},     {"tilt_range_deg", calibration.tilt_range_deg()}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    result["parameters"][names[i]] = {{"value", values[i]}, {"deviation", calibration.deviations[i]}};
  }
  result["views"] = ordered_json::array();
  for (std::size_t v = 0; v < calibration.views.size(); ++v) {
    const Calibration::View& view = calibration.views[v];
    result["views"].push_back({{"image", set.views()[v].label},
                               {"points", view.residuals_px.size()},
                               {"edge_px", set.views()[v].edge_px},
                               {"rms_px", view.rms_px},
                               {"pose", {{"R", view.pose.R}, {"t", view.pose.t}}}});
  }
  return result;
}

std::string residual_svg(const Calibration& calibration, const ViewSet& set) {
  const double side = std::max(set.width(), set.height()), scale_px = residual_scale_px(calibration);
  const double enlarged = 0.03 * side / scale_px;
  SvgPanel image(72, 80, 420, fmt::format("Residuals in the image, {:.0f} times", enlarged), "x, px", "y, px");
  image.fit(-0.5, side - 0.5, -0.5, side - 0.5);
  image.flip_up();
  SvgPanel cloud(592, 80, 420, "All residuals", "in x, px", "in y, px");
  cloud.fit(-scale_px, scale_px, -scale_px, scale_px);
  cloud.flip_up();
  std::string svg = svg_head(
      1060, 560, fmt::format("Calibration: {} views, {:.3f} px RMS", calibration.views.size(), calibration.rms_px));
  svg += image.frame(true) + cloud.frame(true);
  int beyond = 0;
  const double right = set.width() - 0.5, bottom = set.height() - 0.5;
  svg += svg_polyline(image, {{-0.5, -0.5}, {right, -0.5}, {right, bottom}, {-0.5, bottom}}, "#8a8f98", 1, true);
  for (std::size_t v = 0; v < calibration.views.size(); ++v) {
    const BoardView& view = set.views()[v];
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      const std::array<double, 2>&at = view.seen_px[i], off = calibration.views[v].residuals_px[i];
      svg += svg_polyline(image, {at, {at[0] + enlarged * off[0], at[1] + enlarged * off[1]}}, "#c8102e", 0.8);
      if (std::fabs(off[0]) <= scale_px && std::fabs(off[1]) <= scale_px) {
        svg += svg_dot(cloud, off, "#1f4e8c", 1.2);
      } else {
        ++beyond;
      }
    }
  }
  if (beyond > 0) svg += fmt::format("<text class='axis' x='592' y='552'>{} points lie beyond</text>\n", beyond);
  return svg + "</svg>\n";
}

}  // namespace berth::cli
