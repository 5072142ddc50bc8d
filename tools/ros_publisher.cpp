#include "ros_publisher.hpp"

#include <fmt/format.h>
#include <time.h>

#include <opencv2/imgcodecs.hpp>
#include <string_view>

namespace berth::cli {
namespace {

// Most of a second of a camera of 300 frames/s: a thread on a busy machine may wait so long for its turn.
constexpr std::size_t kFrameSlots = 256;
constexpr std::size_t kImageSlots = 2;
constexpr std::chrono::milliseconds kReportEvery(1000);
constexpr int kJpegQuality = 80;

std::int64_t thread_cpu_ns() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// Adds the calling thread's processor time between its making and its end.
class CpuTimer {
 public:
  explicit CpuTimer(std::int64_t& sum_ns) : sum_ns_(sum_ns) {}
  ~CpuTimer() { sum_ns_ += thread_cpu_ns() - start_; }
  CpuTimer(const CpuTimer&) = delete;
  CpuTimer& operator=(const CpuTimer&) = delete;

 private:
  std::int64_t& sum_ns_;
  std::int64_t start_ = thread_cpu_ns();
};

}  // namespace

std::shared_ptr<FrameObserver> make_ros_publisher(const RosPlan& plan) { return std::make_shared<RosPublisher>(plan); }

RosPublisher::RosPublisher(RosPlan plan) : plan_(std::move(plan)), writers_(plan_) {}

void RosPublisher::begin(const ObservedStream& stream) {
  dock_ = std::make_unique<RosDock>(plan_.dock, stream.config);
  health_ = std::make_unique<RosHealth>(stream.backend);
  for (const Bundle& bundle : stream.config.bundles) bundle_frames_.push_back(plan_.frame_prefix + bundle.name);
  for (const DiscTarget& target : stream.config.disc_targets) {
    target_frames_.push_back(plan_.frame_prefix + target.name);
  }
  if (!plan_.parent.empty()) {
    add_transform({unix_ns(), plan_.parent}, plan_.camera_frame, plan_.mount);
    writers_.send(RosTopic::tf_static, transforms_, results_);
  }
  writers_.wait_for_readers();
  reported_ = std::chrono::steady_clock::now();
  worker_ = std::make_unique<BoundedWorker<Item>>(
      "berth-ros", kFrameSlots, [this](Item& item) { publish(item); }, kReportEvery, [this] { publish_health(); });
  if (plan_.images.empty()) return;
  image_worker_ = std::make_unique<BoundedWorker<ImageItem>>("berth-ros-image", kImageSlots,
                                                             [this](ImageItem& item) { publish_image(item); });
}

void RosPublisher::observe(const ObservedFrame& frame) {
  const FrameStamp& stamp = frame.result.stamp;
  const std::int64_t stamp_ns = ros_stamp_ns(plan_, stamp.clock, stamp.mid_exposure_ns);
  const bool taken = worker_->offer([&](Item& item) {
    item.stamp_ns = stamp_ns;
    item.latency_ns = frame.paced != nullptr ? frame.paced->laps_ns[static_cast<std::size_t>(Lap::latency)] : -1;
    item.result = frame.result;
    item.engine = frame.engine;
    item.camera = frame.camera;
  });
  if (!taken) ++unpublished_;
  if (image_worker_) offer_image(frame, stamp_ns);
}

void RosPublisher::offer_image(const ObservedFrame& frame, std::int64_t stamp_ns) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_image_) return;
  next_image_ = now + std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / plan_.image_rate));
  image_worker_->offer([&](ImageItem& item) {
    item.stamp_ns = stamp_ns;
    item.width = frame.image.width;
    item.height = frame.image.height;
    item.pixels.clear();
    for (int y = 0; y < frame.image.height; ++y) {
      item.pixels.insert(item.pixels.end(), frame.image.row(y), frame.image.row(y) + frame.image.width);
    }
  });
}

void RosPublisher::publish(const Item& item) {
  const CpuTimer timer(cpu_ns_);
  const ros2::Header header = {item.stamp_ns, plan_.camera_frame};
  const FrameResult& result = item.result;
  health_->add(result, item.engine, item.latency_ns);
  const RosDock::Seen dock = dock_->in(result);
  if (dock.pose != nullptr) writers_.send(RosTopic::dock_pose, ros2::PoseStamped{header, *dock.pose}, results_);
  if (dock.covariance != nullptr) {
    writers_.send(RosTopic::pose, ros2::PoseWithCovarianceStamped{header, *dock.pose, *dock.covariance}, results_);
  }
  transforms_.transforms.clear();
  for (const Detection& d : result.detections) {
    if (d.has_pose) add_transform(header, frame_of(*d.family, d.id), d.pose);
  }
  for (std::size_t i = 0; i < result.bundles.size(); ++i) {
    if (result.bundles[i].has_pose) add_transform(header, bundle_frames_[i], result.bundles[i].pose);
  }
  for (std::size_t i = 0; i < result.disc_targets.size(); ++i) {
    if (result.disc_targets[i].has_pose) add_transform(header, target_frames_[i], result.disc_targets[i].pose);
  }
  if (!transforms_.transforms.empty()) writers_.send(RosTopic::tf, transforms_, results_);
  writers_.send(RosTopic::detections, ros2::AprilTagDetectionArray{header, result.detections}, results_);
  if (item.camera) writers_.send(RosTopic::camera_info, ros2::CameraInfo{header, *item.camera}, results_);
}

void RosPublisher::add_transform(const ros2::Header& header, std::string_view child, const Pose& pose) {
  transforms_.transforms.push_back({header, child, pose});
}

std::string_view RosPublisher::frame_of(const MarkerFamily& family, int id) {
  std::string& name = marker_frames_[{&family, id}];
  // As apriltag_ros names them.
  if (name.empty()) name = plan_.frame_prefix + family.name + ":" + std::to_string(id);
  return name;
}

void RosPublisher::publish_image(const ImageItem& item) {
  const cv::Mat image(item.height, item.width, CV_8UC1, const_cast<u8*>(item.pixels.data()));
  std::vector<u8> file;
  cv::imencode(plan_.images == "png" ? ".png" : ".jpg", image, file,
               plan_.images == "png" ? std::vector<int>{} : std::vector<int>{cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  writers_.send(RosTopic::image, ros2::CompressedImage{{item.stamp_ns, plan_.camera_frame}, plan_.images, file},
                images_);
}

void RosPublisher::publish_health() {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - reported_).count();
  reported_ = now;
  RosHealth::Beside beside;
  beside.unpublished = unpublished_;
  beside.unsent = results_.unsent;
  beside.refused = writers_.refused();
  writers_.send(RosTopic::diagnostics, health_->report(unix_ns(), seconds, beside), results_);
}

void RosPublisher::finish(std::ostream& people) {
  if (!worker_) return;
  worker_->finish();
  if (image_worker_) image_worker_->finish();
  publish_health();
  const std::uint64_t frames = worker_->taken();
  std::string head =
      fmt::format("{} frames published in domain {}, {} dropped", frames, plan_.domain, unpublished_.load());
  if (frames > 0) {
    head += fmt::format("; {:.3f} ms of processor time each",
                        static_cast<double>(cpu_ns_) / 1e6 / static_cast<double>(frames));
  }
  writers_.sum_up(people, head, results_.unsent + images_.unsent);
}

}  // namespace berth::cli
