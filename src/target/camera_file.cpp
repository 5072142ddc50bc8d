// Camera files of other programs: Kalibr's camchain and PhotonVision's calibration; and what a file is.

#include <algorithm>

#include "berth/camera.hpp"
#include "berth/error.hpp"
#include "target/camera_fields.hpp"

namespace berth {
namespace {

/// "cam0", "cam1", …
bool is_camera_name(const std::string& name) {
  return name.size() > 3 && name.compare(0, 3, "cam") == 0 &&
         std::all_of(name.begin() + 3, name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

CameraModel read_kalibr(const CameraFields& file, const std::string& name) {
  std::vector<std::string> cameras = file.names();
  cameras.erase(std::remove_if(cameras.begin(), cameras.end(), [](const auto& one) { return !is_camera_name(one); }),
                cameras.end());
  if (name.empty() && cameras.size() > 1) {
    file.fail(cameras[1], "one of " + std::to_string(cameras.size()) + " cameras in the file",
              "say which by adding # and its name, e.g. FILE#" + cameras[1]);
  }
  const std::string chosen = name.empty() ? cameras.at(0) : name;
  std::string known;
  for (const std::string& camera_name : cameras) known += (known.empty() ? "" : ", ") + camera_name;
  const CameraFields one = file.table(chosen, "the file has " + known);
  if (one.text("camera_model") != "pinhole") {
    one.fail("camera_model", "\"" + one.text("camera_model") + "\" is not supported", "calibrate with pinhole");
  }
  CameraModel camera;
  const std::vector<double> size = one.list("resolution", {2}, "give width and height");
  camera.width = one.side("resolution[0]", size[0]);
  camera.height = one.side("resolution[1]", size[1]);
  const std::vector<double> k = one.list("intrinsics", {4}, "give fx fy cx cy");
  one.set_pinhole({"intrinsics[0]", "intrinsics[1]", "intrinsics[2]", "intrinsics[3]"}, {k[0], k[1], k[2], k[3]},
                  camera);
  const std::string lens = one.text("distortion_model");
  if (lens == "none") return camera;
  if (lens != "radtan" && lens != "equidistant") {
    one.fail("distortion_model", "\"" + lens + "\" is not supported", "calibrate with pinhole-radtan or pinhole-equi");
  }
  one.set_lens(lens == "radtan" ? LensModel::radial_tangential : LensModel::equidistant, "distortion_coeffs",
               one.list("distortion_coeffs", {4}, "give the four coefficients of Kalibr's model"), camera);
  return camera;
}

CameraModel read_photonvision(const CameraFields& file) {
  CameraModel camera;
  const CameraFields size = file.table("resolution", "give width and height");
  camera.width = size.side("width");
  camera.height = size.side("height");
  file.set_matrix("cameraIntrinsics", camera);
  // Older files have the coefficients by the name of something else.
  const std::string field = file.has("distCoeffs") ? "distCoeffs" : "cameraExtrinsics";
  const bool fisheye = file.has("isFisheye") && file.boolean("isFisheye");
  const std::string remedy = fisheye ? "give k1 k2 k3 k4" : "give OpenCV's 4, 5 or 8 coefficients";
  const std::vector<double> coefficients =
      file.table(field, remedy)
          .list("data", fisheye ? std::vector<std::size_t>{4} : std::vector<std::size_t>{4, 5, 8}, remedy);
  file.set_lens(fisheye ? LensModel::equidistant : LensModel::radial_tangential, field + ".data", coefficients, camera);
  return camera;
}

CameraModel read_camera(const std::string& path) {
  const std::size_t mark = path.rfind('#');
  const std::string after = mark == std::string::npos ? "" : path.substr(mark + 1);
  const bool named = is_camera_name(after);
  const CameraFields file = CameraFields::open(named ? path.substr(0, mark) : path);
  const std::vector<std::string> names = file.names();
  const bool kalibr = std::any_of(names.begin(), names.end(), is_camera_name);
  if (named && !kalibr) throw Error(path + ": no camera of that name; only a Kalibr camchain has names");
  if (kalibr) return read_kalibr(file, named ? after : "");
  return file.has("cameraIntrinsics") ? read_photonvision(file) : read_ros(file);
}

}  // namespace berth
