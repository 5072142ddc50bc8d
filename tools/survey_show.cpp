#include "survey_show.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "exact_math.hpp"
#include "pose_algebra.hpp"
#include "svg_panel.hpp"

namespace berth::cli {
namespace {

/// Axis times angle, degrees; also of half a turn.
Vec3 turn_deg(const Pose& pose) {
  cv::Vec3d turn;
  cv::Rodrigues(cv::Matx33d(pose.R.data()), turn);
  return {turn[0] * kDegrees, turn[1] * kDegrees, turn[2] * kDegrees};
}

/// With two digits; nothing is -0.00.
std::string rounded(double value) { return fmt::format("{:.2f}", std::round(100 * value) / 100 + 0.0); }

/// Of the two axes.
SvgPoints corners_of(const BundleMarker& marker, std::size_t across, std::size_t up) {
  SvgPoints points;
  for (const Vec3& corner : corner_places(marker.size_m)) {
    const Vec3 at = transform(marker.pose, corner);
    points.push_back({at[across], at[up]});
  }
  return points;
}

std::string panel_svg(const Survey& survey, SvgPanel& panel, std::size_t across, std::size_t up) {
  std::array<double, 2> low = {1e300, 1e300};
  std::array<double, 2> high = {-1e300, -1e300};
  for (const BundleMarker& marker : survey.bundle.markers) {
    for (const std::array<double, 2>& p : corners_of(marker, across, up)) {
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
  }
  const double half = 0.56 * std::max(high[0] - low[0], high[1] - low[1]);
  const double x = (low[0] + high[0]) / 2, y = (low[1] + high[1]) / 2;
  panel.fit(x - half, x + half, y - half, y + half);
  std::string svg = panel.frame(true);
  for (std::size_t m = 0; m < survey.bundle.markers.size(); ++m) {
    const BundleMarker& marker = survey.bundle.markers[m];
    const char* colour = m == survey.origin ? "#c8102e" : "#1f4e8c";
    const SvgPoints corners = corners_of(marker, across, up);
    svg += svg_polyline(panel, corners, colour, 1.6, true);
    svg += svg_dot(panel, corners[0], colour, 3);
    svg += fmt::format("<text class='tick' x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text>\n",
                       panel.x(marker.pose.t[across]), panel.y(marker.pose.t[up]) + 4, marker.id);
  }
  return svg;
}

}  // namespace

std::string survey_text(const Survey& survey) {
  const bool free_sizes = std::any_of(survey.markers.begin(), survey.markers.end(),
                                      [](const SurveyedMarker& marker) { return marker.size_deviation_m > 0; });
  std::string text = fmt::format("  {:<16} {:>8} {:>9} {:>9} {:>9} {:>7}  {:>8} {:>8} {:>8} {:>7} {:>7} {:>7} {:>9}\n",
                                 "marker", "size mm", "x mm", "y", "z", "+- mm", "turn x", "y", "z deg", "+- deg",
                                 "frames", "px RMS", "rejected");
  for (std::size_t m = 0; m < survey.bundle.markers.size(); ++m) {
    const BundleMarker& marker = survey.bundle.markers[m];
    const SurveyedMarker& known = survey.markers[m];
    const Vec3 at = scaled(marker.pose.t, 1000), turn = turn_deg(marker.pose);
    const bool origin = m == survey.origin;
    text +=
        fmt::format("  {:<16} {:>8} {:>9} {:>9} {:>9} {:>7}  {:>8} {:>8} {:>8} {:>7} {:>7} {:>7.3f} {:>9}\n",
                    name_of(marker), rounded(1000 * marker.size_m), rounded(at[0]), rounded(at[1]), rounded(at[2]),
                    origin ? "origin" : fmt::format("{:.3f}", 1000 * known.position_deviation_m()), rounded(turn[0]),
                    rounded(turn[1]), rounded(turn[2]), origin ? "" : fmt::format("{:.3f}", known.turn_deviation_deg()),
                    known.frames, known.rms_px, fmt::format("{}/{}", known.rejected, known.corners));
    if (free_sizes && !origin)
      text += fmt::format("  {:<16} {:>8}\n", "", fmt::format("+-{:.3f}", 1000 * known.size_deviation_m));
  }
  text += fmt::format(
      "{} frames from directions {:.0f} degrees apart: {} corners, {} rejected, the others {:.3f} px RMS from where "
      "they "
      "should be\n",
      survey.frames, survey.view_range_deg, survey.corners, survey.rejected, survey.rms_px);
  if (survey.correlation > 1) {
    text += fmt::format("the residuals go together: deviations are {:.1f} times those of independent ones\n",
                        survey.correlation);
  }
  return text;
}

nlohmann::ordered_json survey_json(const Survey& survey) {
  using nlohmann::ordered_json;
  ordered_json result = {{"frames", survey.frames},           {"corners", survey.corners},
                         {"rejected", survey.rejected},       {"rms_px", survey.rms_px},
                         {"correlation", survey.correlation}, {"view_range_deg", survey.view_range_deg}};
  result["markers"] = ordered_json::array();
  for (std::size_t m = 0; m < survey.bundle.markers.size(); ++m) {
    const BundleMarker& marker = survey.bundle.markers[m];
    const SurveyedMarker& known = survey.markers[m];
    const std::array<double, 6>& d = known.deviations;
    result["markers"].push_back({{"family", marker.family->name},
                                 {"id", marker.id},
                                 {"size_m", marker.size_m},
                                 {"size_deviation_m", known.size_deviation_m},
                                 {"pose", {{"R", marker.pose.R}, {"t", marker.pose.t}}},
                                 {"deviation_m", {d[0], d[1], d[2]}},
                                 {"deviation_deg", {d[3], d[4], d[5]}},
                                 {"frames", known.frames},
                                 {"corners", known.corners},
                                 {"rejected", known.rejected},
                                 {"rms_px", known.rms_px}});
  }
  return result;
}

std::string layout_svg(const Survey& survey) {
  SvgPanel front(72, 80, 420, "From the front", "x, m", "y, m");
  front.flip_up();
  SvgPanel above(592, 80, 420, "From above", "x, m", "z, m");
  const std::string title = fmt::format("{}: {} markers, in the frame of {}", survey.bundle.name,
                                        survey.bundle.markers.size(), name_of(survey.bundle.markers[survey.origin]));
  return svg_head(1060, 560, title) + panel_svg(survey, front, 0, 1) + panel_svg(survey, above, 0, 2) + "</svg>\n";
}

}  // namespace berth::cli
