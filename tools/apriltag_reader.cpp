#include "apriltag_reader.hpp"

#if BERTH_WITH_APRILTAG
#include <apriltag/apriltag.h>
#include <apriltag/apriltag_pose.h>
#include <apriltag/tag36h11.h>

#include <algorithm>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <vector>
#endif

#include "berth/error.hpp"

namespace berth::cli {

#if BERTH_WITH_APRILTAG

namespace {

/// A matrix of the library's, freed when it goes. Debian hides matd_destroy, which is free.
using Matrix = std::unique_ptr<matd_t, void (*)(void*)>;

/// Pose of `detection`, whose p and H become what a camera without distortion would have seen.
Pose pose_of(apriltag_detection_t& detection, const CameraModel& camera, double size_m) {
  // Where p[i] lies on the marker, half sides: from the lower left, counter-clockwise.
  const std::vector<cv::Point2f> places = {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}};
  std::vector<cv::Point2f> seen;
  for (double* p : detection.p) {
    const std::array<double, 2> ray = camera.undistort(p[0] - 0.5, p[1] - 0.5);
    p[0] = camera.fx * ray[0] + camera.cx;
    p[1] = camera.fy * ray[1] + camera.cy;
    seen.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]));
  }
  // From floats, but only where the library's own iteration starts.
  const cv::Mat_<double> homography = cv::getPerspectiveTransform(places, seen);
  std::copy(homography.begin(), homography.end(), detection.H->data);
  apriltag_detection_info_t info = {&detection, size_m, camera.fx, camera.fy, camera.cx, camera.cy};
  apriltag_pose_t found = {nullptr, nullptr};
  estimate_tag_pose(&info, &found);
  const Matrix R(found.R, std::free);
  const Matrix t(found.t, std::free);
  Pose pose;
  std::copy_n(R->data, 9, pose.R.begin());
  std::copy_n(t->data, 3, pose.t.begin());
  return pose;
}

}  // namespace

struct AprilTagReader::Library {
  Library() {
    apriltag_detector_add_family(detector, family);
    detector->quad_decimate = 1;
    detector->nthreads = 1;
  }
  ~Library() {
    apriltag_detector_destroy(detector);
    tag36h11_destroy(family);
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  apriltag_family_t* family = tag36h11_create();
  apriltag_detector_t* detector = apriltag_detector_create();
};

bool AprilTagReader::built_in() { return true; }
AprilTagReader::AprilTagReader() : library_(std::make_unique<Library>()) {}

std::optional<AprilTagReader::Found> AprilTagReader::read(View2D<const u8> image, int id, const CameraModel& camera,
                                                          double size_m) {
  // The library takes no const image and does not write to it.
  image_u8_t view = {image.width, image.height, image.stride, const_cast<u8*>(image.data)};
  const std::unique_ptr<zarray_t, void (*)(zarray_t*)> detections(apriltag_detector_detect(library_->detector, &view),
                                                                  apriltag_detections_destroy);
  for (int i = 0; i < zarray_size(detections.get()); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(detections.get(), i, &detection);
    if (detection->id != id) continue;
    Found found;
    // Its pixel centres lie at halves.
    for (std::size_t k = 0; k < 4; ++k) {
      found.corners[(k + 1) % 4] = {detection->p[k][0] - 0.5, detection->p[k][1] - 0.5};
    }
    found.pose = pose_of(*detection, camera, size_m);
    return found;
  }
  return std::nullopt;
}

#else

struct AprilTagReader::Library {};
bool AprilTagReader::built_in() { return false; }
AprilTagReader::AprilTagReader() { throw Error("this build has no libapriltag; build with -DBERTH_WITH_APRILTAG=ON"); }
std::optional<AprilTagReader::Found> AprilTagReader::read(View2D<const u8> /*image*/, int /*id*/,
                                                          const CameraModel& /*camera*/, double /*size_m*/) {
  return std::nullopt;
}

#endif

AprilTagReader::~AprilTagReader() = default;

}  // namespace berth::cli
