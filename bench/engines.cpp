#include "engines.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <optional>
#include <utility>

#include "as_mat.hpp"
#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "target/opencv_aruco.hpp"

namespace berth::bench {
namespace {

class BerthEngine final : public Engine {
 public:
  BerthEngine(const std::string& backend, int threads) : name_(backend) {
    BackendOptions options;
    options.threads = threads;
    backend_ = open_backend(backend, options);
  }
  const std::string& name() const override { return name_; }
  void run(View2D<const u8> image) override {
    if (!detector_ || image.width != width_ || image.height != height_) {
      detector_.emplace(*backend_, image.width, image.height, DetectorConfig{});
      width_ = image.width;
      height_ = image.height;
    }
    result_ = &detector_->detect(image);
  }
  std::vector<Found> found() const override {
    std::vector<Found> all;
    for (const Detection& detection : result_->detections) all.push_back({detection.id, detection.corners});
    return all;
  }

 private:
  std::string name_;
  std::unique_ptr<Backend> backend_;
  std::optional<Detector> detector_;
  int width_ = 0;
  int height_ = 0;
  const FrameResult* result_ = nullptr;
};

class ApriltagEngine final : public Engine {
 public:
  ApriltagEngine(float decimate, int min_white_black_diff)
      : name_("apriltag-d" + std::to_string(static_cast<int>(decimate)) + (min_white_black_diff == 5 ? "" : "-tuned")),
        family_(tag36h11_create()),
        detector_(apriltag_detector_create()) {
    apriltag_detector_add_family(detector_, family_);
    detector_->quad_decimate = decimate;
    detector_->qtp.min_white_black_diff = min_white_black_diff;
    detector_->nthreads = 1;
  }
  ~ApriltagEngine() override {
    if (detections_ != nullptr) apriltag_detections_destroy(detections_);
    apriltag_detector_destroy(detector_);
    tag36h11_destroy(family_);
  }
  ApriltagEngine(const ApriltagEngine&) = delete;
  ApriltagEngine& operator=(const ApriltagEngine&) = delete;
  const std::string& name() const override { return name_; }
  void run(View2D<const u8> image) override {
    if (detections_ != nullptr) apriltag_detections_destroy(detections_);
    // The library takes no const image and does not write to it.
    image_u8_t view = {image.width, image.height, image.stride, const_cast<u8*>(image.data)};
    detections_ = apriltag_detector_detect(detector_, &view);
  }
  std::vector<Found> found() const override {
    std::vector<Found> all;
    for (int i = 0; i < zarray_size(detections_); ++i) {
      const apriltag_detection_t* detection = nullptr;
      zarray_get(detections_, i, &detection);
      Found one{detection->id, {}};
      // Its corners begin at the lower left, counter-clockwise; its pixel centres lie at halves.
      for (std::size_t k = 0; k < 4; ++k) {
        one.corners[(k + 1) % 4] = {detection->p[k][0] - 0.5, detection->p[k][1] - 0.5};
      }
      all.push_back(one);
    }
    return all;
  }

 private:
  std::string name_;
  apriltag_family_t* family_;
  apriltag_detector_t* detector_;
  zarray_t* detections_ = nullptr;
};

class ArucoEngine final : public Engine {
 public:
  ArucoEngine() : detector_(aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11), refining()) {
    cv::setNumThreads(1);
  }
  const std::string& name() const override { return name_; }
  void run(View2D<const u8> image) override { detector_.detectMarkers(as_mat(image), corners_, ids_); }
  std::vector<Found> found() const override {
    std::vector<Found> all;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      Found one{ids_[i], {}};
      // Its upper left is AprilTag's lower right: the dictionary holds the codes turned by half a turn; clockwise.
      for (std::size_t k = 0; k < 4; ++k) {
        const cv::Point2f& corner = corners_[i][(6 - k) % 4];
        one.corners[k] = {corner.x, corner.y};
      }
      all.push_back(one);
    }
    return all;
  }

 private:
  static aruco::DetectorParameters refining() {
    aruco::DetectorParameters parameters;
    parameters.cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    return parameters;
  }

  std::string name_ = "aruco";
  aruco::ArucoDetector detector_;
  std::vector<std::vector<cv::Point2f>> corners_;
  std::vector<int> ids_;
};

}  // namespace

std::unique_ptr<Engine> make_berth(const std::string& backend, int threads) {
  return std::make_unique<BerthEngine>(backend, threads);
}
std::unique_ptr<Engine> make_apriltag(float decimate, int min_white_black_diff) {
  return std::make_unique<ApriltagEngine>(decimate, min_white_black_diff);
}
std::unique_ptr<Engine> make_opencv_aruco() { return std::make_unique<ArucoEngine>(); }

std::unique_ptr<Engine> make_engine(const std::string& name, int threads) {
  if (name == "apriltag-d1") return make_apriltag(1, 5);
  if (name == "apriltag-d1-tuned") return make_apriltag(1, 20);
  if (name == "apriltag-d2") return make_apriltag(2, 5);
  if (name == "apriltag-d2-tuned") return make_apriltag(2, 20);
  if (name == "aruco") return make_opencv_aruco();
  return make_berth(name, threads);
}

}  // namespace berth::bench
