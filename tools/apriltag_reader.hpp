#pragma once

#include <array>
#include <memory>
#include <optional>

#include "berth/camera.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"

namespace berth::cli {

/// libapriltag as it comes, at full resolution, on tag36h11: what Berth is compared with. Builds without it
/// (BERTH_WITH_APRILTAG) have a reader that must not be made.
class AprilTagReader {
 public:
  static bool built_in();

  AprilTagReader();
  ~AprilTagReader();
  AprilTagReader(const AprilTagReader&) = delete;
  AprilTagReader& operator=(const AprilTagReader&) = delete;

  struct Found {
    /// As Detection's.
    std::array<std::array<double, 2>, 4> corners = {};
    /// Its own estimate_tag_pose; it knows no lens, so its corners are undistorted before.
    Pose pose;
  };
  /// The marker of that id; none where it is not found.
  std::optional<Found> read(View2D<const u8> image, int id, const CameraModel& camera, double size_m);

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace berth::cli
