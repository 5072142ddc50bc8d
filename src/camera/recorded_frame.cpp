#include "camera/recorded_frame.hpp"

#include <nlohmann/json.hpp>

#include "berth/error.hpp"
#include "camera/recorded_number.hpp"
#include "camera/recorded_pose.hpp"

namespace berth {
namespace {

using Json = nlohmann::json;

TruthMarker truth_marker(const Json& json) {
  TruthMarker marker;
  marker.family = json.at("family").get<std::string>();
  marker.id = whole_number<int>(json, "id");
  marker.size_m = json.at("size").get<double>();
  marker.visible = json.at("visible").get<double>();
  marker.corners = json.at("corners").get<std::array<std::array<double, 2>, 4>>();
  marker.pose = recorded_pose(json.at("pose"));
  return marker;
}

}  // namespace

std::string recorded_camera_text(const CameraModel& camera) {
  const Json json = {{"width", camera.width},
                     {"height", camera.height},
                     {"fx", camera.fx},
                     {"fy", camera.fy},
                     {"cx", camera.cx},
                     {"cy", camera.cy},
                     {"lens", camera.lens == LensModel::equidistant ? "equidistant" : "radial_tangential"},
                     {"distortion", camera.distortion}};
  return json.dump();
}

CameraModel read_recorded_camera(const std::string& text, const std::string& name) {
  try {
    const Json json = Json::parse(text);
    CameraModel camera;
    camera.width = whole_number<int>(json, "width");
    camera.height = whole_number<int>(json, "height");
    camera.fx = json.at("fx").get<double>();
    camera.fy = json.at("fy").get<double>();
    camera.cx = json.at("cx").get<double>();
    camera.cy = json.at("cy").get<double>();
    if (json.at("lens").get<std::string>() == "equidistant") camera.lens = LensModel::equidistant;
    camera.distortion = json.at("distortion").get<std::array<double, 8>>();
    if (camera.width < 1 || camera.height < 1 || !(camera.fx > 0) || !(camera.fy > 0)) {
      throw Error("sides and focal lengths must be above 0");
    }
    return camera;
  } catch (const std::exception& error) {
    throw Error(name + ": the recorded camera cannot be read (" + error.what() + "); give --camera");
  }
}

RecordedFrame read_recorded_frame(const std::string& text, const std::string& name) {
  try {
    const Json json = Json::parse(text);
    RecordedFrame recorded;
    SourceFrame& frame = recorded.frame;
    frame.stamp.sequence = whole_number<u64>(json, "frame");
    frame.stamp.exposure_start_ns = whole_number<std::int64_t>(json, "exposure_start_ns");
    frame.stamp.mid_exposure_ns = whole_number<std::int64_t>(json, "mid_exposure_ns");
    frame.stamp.arrival_ns = whole_number<std::int64_t>(json, "arrival_ns");
    recorded.clock = json.at("clock").get<std::string>();
    frame.label = json.at("label").get<std::string>();
    if (json.contains("missed")) recorded.missed = whole_number<u64>(json, "missed");
    if (json.contains("truth")) {
      for (const Json& marker : json.at("truth")) frame.truth.push_back(truth_marker(marker));
    }
    if (json.contains("truth_targets")) {
      for (const Json& target : json.at("truth_targets")) {
        frame.truth_targets.push_back({target.at("name").get<std::string>(), recorded_pose(target.at("pose"))});
      }
    }
    return recorded;
  } catch (const std::exception& error) {
    throw Error(name + ": a frame's record cannot be read (" + error.what() + "); it is left out");
  }
}

}  // namespace berth
