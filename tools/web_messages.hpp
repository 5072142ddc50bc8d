#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "frame_json.hpp"
#include "web_feed.hpp"

namespace berth::cli {

/// What holds for a whole run.
struct WebAbout {
  /// Of this run alone: a page that sees another forgets what it has gathered.
  std::string run;
  /// As the command line names the source.
  std::string source;
  std::string backend;
  int width = 0, height = 0;
  /// For the camera's pyramid in the drawing; none where none is known.
  std::optional<CameraModel> camera;
  bool is_filtered = false;
  /// Whether a token allows a viewer to end the run.
  bool can_control = false;
};

/// To so many decimals (1e4: four); null where it is no number.
Json rounded(double value, double scale);

/// For WebAbout::run.
std::string new_run_name();

/// Once, to each viewer.
Json to_json(const WebAbout& about);
/// `now_s`: by the page's clock, in which the status tells its times too. `ended`: no frame comes any more.
Json to_json(const WebStatus& status, double now_s, bool ended);
Json to_json(const std::vector<WebObject>& objects);
/// [time, object, six values, six deviations, range, its deviation, closing speed, its deviation, error px, ambiguity];
/// null for what is not known.
Json to_json(const WebSample& sample);

}  // namespace berth::cli
