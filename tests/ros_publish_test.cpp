// What `berth run --ros` makes of its options and of frames, short of the network: ros2/publish_test.py has that.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <numeric>

#include "berth/error.hpp"
#include "bounded_worker.hpp"
#include "ros_dock.hpp"
#include "ros_health.hpp"
#include "ros_options.hpp"
#include "support/complaint.hpp"
#include "support/scratch_folder.hpp"

namespace berth::cli {
namespace {

using test::complaint;
using testing::AllOf;
using testing::ElementsAreArray;
using testing::HasSubstr;

TEST(RosOptions, TopicsLieInTheNamespaceUnlessTheyBeginWithASlash) {
  RosOptions options;
  options.name_space = "/robot1";
  options.topics = {"tf=/tf", "pose=dock/pose", "detections=off"};
  const RosPlan plan = make_ros_plan(options);
  EXPECT_EQ(plan.topic(RosTopic::tf).name, "tf");
  EXPECT_EQ(plan.topic(RosTopic::pose).name, "robot1/dock/pose");
  EXPECT_EQ(plan.topic(RosTopic::detections).name, "");
  EXPECT_EQ(plan.topic(RosTopic::dock_pose).name, "robot1/detected_dock_pose");
  EXPECT_EQ(plan.topic(RosTopic::image).name, "");
  options.images = "png";
  EXPECT_EQ(make_ros_plan(options).topic(RosTopic::image).name, "robot1/image_raw/compressed");
}

TEST(RosOptions, QualitiesChangeOnlyWhatIsNamed) {
  RosOptions options;
  EXPECT_TRUE(make_ros_plan(options).topic(RosTopic::camera_info).latched);
  options.qos = {"camera_info=best_effort", "pose=transient_local,7"};
  const RosPlan plan = make_ros_plan(options);
  EXPECT_FALSE(plan.topic(RosTopic::camera_info).reliable);
  EXPECT_TRUE(plan.topic(RosTopic::camera_info).latched);
  EXPECT_EQ(plan.topic(RosTopic::camera_info).depth, 1);
  EXPECT_TRUE(plan.topic(RosTopic::pose).reliable);
  EXPECT_TRUE(plan.topic(RosTopic::pose).latched);
  EXPECT_EQ(plan.topic(RosTopic::pose).depth, 7);
}

TEST(RosOptions, AMountTurnsABodysAxesIntoTheImages) {
  RosOptions options;
  options.mount = "base_link,1,2,3,0,0,0";
  const RosPlan plan = make_ros_plan(options);
  EXPECT_EQ(plan.parent, "base_link");
  EXPECT_EQ(plan.mount.t, (std::array<double, 3>{1, 2, 3}));
  // The image's x lies at the body's right, -y; its y down, -z; its z forward, x.
  EXPECT_THAT(plan.mount.R, ElementsAreArray({0, 0, 1, -1, 0, 0, 0, -1, 0}));
  options.mount = "base_link,0,0,0,0,0,90";
  // Turned to the left: forward is the parent's y.
  const std::array<double, 9> left = {1, 0, 0, 0, 0, 1, 0, -1, 0};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(make_ros_plan(options).mount.R[i], left[i], 1e-15) << i;
}

TEST(RosOptions, ComplaintsNameOptionValueAndRemedy) {
  const auto with = [](const auto& change) {
    RosOptions options;
    change(options);
    return complaint([&] { make_ros_plan(options); });
  };
  EXPECT_THAT(with([](RosOptions& o) { o.name_space = "2nd robot"; }),
              AllOf(HasSubstr("--ros-namespace 2nd robot: "), HasSubstr("letters, digits and _")));
  EXPECT_THAT(with([](RosOptions& o) { o.topics = {"odom=x"}; }),
              AllOf(HasSubstr("--ros-topic odom=x: "), HasSubstr("detected_dock_pose")));
  EXPECT_THAT(with([](RosOptions& o) { o.topics = {"tf="}; }), HasSubstr("--ros-topic tf=: "));
  EXPECT_THAT(with([](RosOptions& o) { o.qos = {"tf=fast"}; }),
              AllOf(HasSubstr("--ros-qos tf=fast: \"fast\""), HasSubstr("best_effort")));
  EXPECT_THAT(with([](RosOptions& o) { o.qos = {"tf=0"}; }), HasSubstr("--ros-qos tf=0: "));
  EXPECT_THAT(with([](RosOptions& o) { o.qos = {"tf=1,"}; }), HasSubstr("--ros-qos tf=1,: "));
  EXPECT_THAT(with([](RosOptions& o) { o.mount = "base_link,1,2,3"; }),
              AllOf(HasSubstr("--ros-mount base_link,1,2,3: "), HasSubstr("metres and degrees")));
  EXPECT_THAT(with([](RosOptions& o) { o.mount = "base_link,1,2,3,nan,0,0"; }), HasSubstr("--ros-mount"));
  EXPECT_THAT(with([](RosOptions& o) { o.camera_frame = "my camera"; }), HasSubstr("--ros-frame \"my camera\": "));
}

TEST(RosOptions, TheDomainIsTheOptionsElseTheEnvironments) {
  RosOptions options;
  ASSERT_EQ(setenv("ROS_DOMAIN_ID", "42", 1), 0);
  EXPECT_EQ(make_ros_plan(options).domain, 42);
  options.domain = 7;
  EXPECT_EQ(make_ros_plan(options).domain, 7);
  options.domain = -1;
  ASSERT_EQ(setenv("ROS_DOMAIN_ID", "233", 1), 0);
  EXPECT_THAT(complaint([&] { make_ros_plan(options); }), HasSubstr("ROS_DOMAIN_ID 233: "));
  ASSERT_EQ(unsetenv("ROS_DOMAIN_ID"), 0);
  EXPECT_EQ(make_ros_plan(options).domain, 0);
}

Detection marker(int id, bool has_pose) {
  Detection detection;
  detection.family = &family("tag36h11");
  detection.id = id;
  detection.has_pose = has_pose;
  return detection;
}

TEST(RosDock, IsTheFirstMarkerWithAPoseAndStaysIt) {
  RosDock dock("", DetectorConfig());
  FrameResult result;
  result.detections = {marker(3, false), marker(5, true), marker(7, true)};
  EXPECT_EQ(dock.in(result).pose, &result.detections[1].pose);
  EXPECT_EQ(dock.in(result).covariance, nullptr);
  result.detections[2].pose_uncertainty.emplace();
  result.detections[1].has_pose = false;
  EXPECT_EQ(dock.in(result).pose, nullptr);
}

TEST(RosDock, IsWhatIsNamed) {
  DetectorConfig config;
  config.bundles.resize(2);
  config.bundles[0].name = "port";
  config.bundles[1].name = "dock: left";
  FrameResult result;
  result.bundles.resize(2);
  result.bundles[1].has_pose = true;
  result.detections = {marker(3, true), marker(5, true)};
  result.detections[1].pose_uncertainty.emplace();
  EXPECT_EQ(RosDock("", config).in(result).pose, nullptr);
  EXPECT_EQ(RosDock("dock: left", config).in(result).pose, &result.bundles[1].pose);
  EXPECT_EQ(RosDock("dock: left", config).in(result).covariance, &result.bundles[1].uncertainty.covariance);
  EXPECT_EQ(RosDock("tag36h11:5", config).in(result).covariance, &result.detections[1].pose_uncertainty->covariance);
  for (const std::string name : {"left", "tag36h11:", "tag36h11:587", "tag25h9:0", "tag36h11:5x"}) {
    EXPECT_THAT(complaint([&] { RosDock(name, config); }),
                AllOf(HasSubstr("--ros-dock " + name + ": "), HasSubstr("bundle port"), HasSubstr("tag36h11:586")));
  }
}

TEST(RosHealth, SaysWhatIsWrongAndCounts) {
  RosHealth health("simd");
  FrameResult result;
  result.stamp.sequence = 10;
  result.detections = {marker(3, true)};
  health.add(result, {}, 2'000'000);
  result.stamp.sequence = 13;  // two were dropped
  health.add(result, {}, 4'000'000);
  const auto& dropped = health.report(5, 0.5, {1, 2, ""}).status[0];
  EXPECT_EQ(dropped.level, ros2::Level::warn);
  EXPECT_EQ(dropped.message, "2 frames dropped");
  std::string values;
  for (const auto& [key, value] : dropped.values) values.append(key).append("=" + value + " ");
  EXPECT_EQ(values,
            "frames=2 frames_with_pose=2 frames_per_second=4.0 frames_dropped=2 frames_not_published=1 "
            "messages_not_sent=2 mode=nominal valid=true known_answers=0 wrong_answers=0 memory_alterations=0 "
            "backend_tries=0 backend_returns=0 recovery= "
            "latency_p50_ms=2.007 latency_p99_ms=4.000 ");
  EXPECT_EQ(health.report(5, 1.5, {}).status[0].level, ros2::Level::stale);
  result.stamp.sequence = 14;
  health.add(result, {}, -1);
  EXPECT_EQ(health.report(5, 1, {}).status[0].level, ros2::Level::ok);
  ++result.stamp.sequence;
  health.add(result, {}, -1);
  EXPECT_THAT(health.report(5, 1, {0, 0, "pose (reliability)"}).status[0].message, HasSubstr("pose (reliability)"));
  ++result.stamp.sequence;
  result.status = FrameStatus::overflow;
  health.add(result, {}, -1);
  EXPECT_EQ(health.report(5, 1, {}).status[0].level, ros2::Level::warn);
  ++result.stamp.sequence;
  result.status = FrameStatus::device_lost;
  health.add(result, {}, -1);
  EXPECT_EQ(health.report(5, 1, {}).status[0].level, ros2::Level::error);
  ++result.stamp.sequence;
  result.status = FrameStatus::ok;
  HealthReport engine;
  engine.mode = HealthMode::fallback;
  engine.reason = "a wrong known answer";
  health.add(result, engine, -1);
  const auto& fallback = health.report(5, 1, {}).status[0];
  EXPECT_EQ(fallback.level, ros2::Level::warn);
  EXPECT_THAT(fallback.message, HasSubstr("another carries on, with the same bits: a wrong known answer"));
}

TEST(BoundedWorker, TakesWhatThereIsRoomForAndHoldsNobodyUp) {
  std::mutex mutex;
  std::condition_variable opened;
  bool open = false;
  std::vector<int> done;
  BoundedWorker<int> worker("test", 3, [&](int& item) {
    std::unique_lock<std::mutex> lock(mutex);
    opened.wait(lock, [&] { return open; });
    done.push_back(item);
  });
  // The worker keeps the slot that it works on.
  int refused = 0;
  for (int i = 0; i < 10; ++i) refused += worker.offer([i](int& item) { item = i; }) ? 0 : 1;
  EXPECT_EQ(refused, 7);
  EXPECT_EQ(worker.taken(), 3u);
  {
    const std::lock_guard<std::mutex> lock(mutex);
    open = true;
  }
  opened.notify_all();
  worker.finish();
  EXPECT_THAT(done, ElementsAreArray({0, 1, 2}));
  EXPECT_FALSE(worker.offer([](int&) {}));
}

TEST(BoundedWorker, PassesEveryItemOnInOrder) {
  std::vector<int> done;
  BoundedWorker<int> worker("test", 4, [&](int& item) { done.push_back(item); });
  for (int i = 0; i < 1000;) {
    if (worker.offer([i](int& item) { item = i; })) {
      ++i;
    } else {
      std::this_thread::yield();
    }
  }
  worker.finish();
  std::vector<int> all(1000);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(done, all);
}

TEST(BoundedWorker, TicksAndThrowsAtTheEndWhatWentWrong) {
  std::mutex mutex;
  std::condition_variable changed;
  int ticks = 0;
  BoundedWorker<int> worker(
      "test", 4, [](int& item) { throw Error("item " + std::to_string(item)); }, std::chrono::milliseconds(1),
      [&] {
        const std::lock_guard<std::mutex> lock(mutex);
        ++ticks;
        changed.notify_one();
      });
  {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] { return ticks >= 2; });
  }
  EXPECT_TRUE(worker.offer([](int& item) { item = 5; }));
  EXPECT_EQ(complaint([&] { worker.finish(); }), "item 5");
}

}  // namespace
}  // namespace berth::cli
