#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "berth/bundle.hpp"
#include "berth/camera.hpp"
#include "survey/survey_frames.hpp"

namespace berth {

struct SurveyOptions {
  /// Side of the markers that sizes_m does not name by id, m.
  double size_m = 0;
  std::map<int, double> sizes_m;
  /// Id of the marker whose frame is the bundle's; else the one that most frames show with others.
  std::optional<int> origin;
  /// Sizes are unknown, but the origin's, which gives the scale; those above are where to start.
  bool free_sizes = false;
  /// One standard deviation of a corner's coordinate where it has no covariance of its own, px. Only what the corners
  /// weigh against each other: how good all of them are is told by the residuals.
  double corner_deviation_px = 0.15;
};

/// How well a marker's place is known, and from what.
struct SurveyedMarker {
  /// One standard deviation of its position along the bundle's axes (m), then of a turn about axes parallel to those
  /// (degrees); 0 for the origin. They follow from the residuals, and from how far the marker moves when frames are
  /// left out (Survey::correlation).
  std::array<double, 6> deviations = {};
  /// Of its size, m; 0 where that was given.
  double size_deviation_m = 0;
  /// Frames that it was kept in, its corners in all frames, and those of them that do not fit and were left out.
  int frames = 0, corners = 0, rejected = 0;
  /// Root mean square distance of the kept corners from where they should be, px.
  double rms_px = 0;

  /// Of the position as a whole (m), and of the turn (degrees).
  double position_deviation_m() const;
  double turn_deviation_deg() const;
};

/// Markers' places, from frames that show several.
struct Survey {
  /// Empty where the frames were refused before there were places; in order of family and id. Without a name; its
  /// deviation is that of the marker that is known worst.
  Bundle bundle;
  /// Of bundle.markers, in its order.
  std::vector<SurveyedMarker> markers;
  /// Which of them gives the frame.
  std::size_t origin = 0;
  /// Frames that took part.
  int frames = 0;
  /// As SurveyedMarker's, of all.
  int corners = 0, rejected = 0;
  double rms_px = 0;
  /// How many times the deviations are those of independent residuals.
  double correlation = 1;
  /// Largest angle between two of the directions that the markers' middle was seen from, degrees.
  double view_range_deg = 0;
  /// Markers that were seen but are not part of it, with the reason.
  std::vector<std::string> notes;
  /// Why there is no result, or none to be trusted, with what to do; empty when all is well.
  std::vector<std::string> objections;
};

/// Bundle adjustment (docs/survey.md): the poses of cameras and markers that explain the corners best. Nothing throws
/// on frames that do not suffice: the objections say so.
Survey survey(const SurveyFrames& frames, const CameraModel& camera, const SurveyOptions& options);

}  // namespace berth
