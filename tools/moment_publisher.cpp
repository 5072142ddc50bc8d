#include "moment_publisher.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>

#include "bounded_worker.hpp"
#include "moment_health.hpp"
#include "ros_writers.hpp"

namespace berth::cli {
namespace {

// As for frames: most of a second of cameras of 300 frames/s.
constexpr std::size_t kSlots = 256;
constexpr std::chrono::milliseconds kReportEvery(1000);

class MomentPublisher final : public MomentObserver {
 public:
  MomentPublisher(const RosPlan& plan, const VehicleFrames& frames, double gate)
      : plan_(plan), frames_(frames), writers_(plan), health_(gate) {}

  void begin() override {
    writers_.wait_for_readers();
    worker_ = std::make_unique<BoundedWorker<Item>>(
        "berth-ros-pair", kSlots, [this](Item& item) { publish(item); }, kReportEvery, [this] { publish_health(); });
  }

  void observe(const ObservedMoment& observed) override {
    const StationMoment& moment = observed.moment;
    const std::int64_t stamp_ns = ros_stamp_ns(plan_, clock_of(moment), moment.time_ns);
    const bool taken = worker_->offer([&](Item& item) { item = {stamp_ns, moment, observed.fused, observed.counts}; });
    if (!taken) ++unpublished_;
  }

  void finish(const BothCounts&, std::ostream& people) override {
    worker_->finish();
    publish_health();
    writers_.sum_up(people,
                    fmt::format("{} moments published in domain {}, {} dropped", worker_->taken(), plan_.domain,
                                unpublished_.load()),
                    sender_.unsent);
  }

 private:
  struct Item {
    std::int64_t stamp_ns = 0;
    StationMoment moment;
    FusedPose fused;
    BothCounts counts;
  };

  // On the worker's thread.

  void publish(const Item& item) {
    health_.add(item.moment, item.fused, item.counts);
    if (!is_agreed(item.fused)) return;
    const RelativePose& robot = item.fused.robot;
    const ros2::TransformList dock = dock_transform(item.stamp_ns, frames_, robot);
    writers_.send(RosTopic::pose, robot_message(item.stamp_ns, frames_, robot), sender_);
    writers_.send(RosTopic::dock_pose, ros2::PoseStamped{{item.stamp_ns, frames_.robot}, dock.transforms[0].pose},
                  sender_);
    writers_.send(RosTopic::tf, dock, sender_);
  }

  void publish_health() {
    ros2::DiagnosticStatus status = health_.report();
    const std::string refused = writers_.refused();
    status.values.push_back({"moments_not_published", fmt::to_string(unpublished_.load())});
    status.values.push_back({"messages_not_sent", fmt::to_string(sender_.unsent)});
    status.values.push_back({"refused", refused});
    writers_.send(RosTopic::diagnostics, ros2::DiagnosticArray{{unix_ns(), ""}, {status}}, sender_);
  }

  const RosPlan plan_;
  const VehicleFrames frames_;
  RosWriters writers_;
  MomentHealth health_;
  RosSender sender_;
  /// Moments that found the queue full.
  std::atomic<std::uint64_t> unpublished_ = 0;
  std::unique_ptr<BoundedWorker<Item>> worker_;
};

}  // namespace

std::unique_ptr<MomentObserver> make_moment_publisher(const RosPlan& plan, const VehicleFrames& frames, double gate) {
  return std::make_unique<MomentPublisher>(plan, frames, gate);
}

}  // namespace berth::cli
