#include "ros_writers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "monotonic.hpp"

namespace berth::cli {

std::int64_t ros_stamp_ns(const RosPlan& plan, std::string_view clock, std::int64_t time_ns) {
  if (plan.source_time) return time_ns;
  // Other clocks say nothing of when that was.
  if (clock != "monotonic") return unix_ns();
  return time_ns + (unix_ns() - monotonic_ns());
}

RosWriters::RosWriters(const RosPlan& plan) : topics_(plan.topics), wait_s_(plan.wait_s), participant_(plan.domain) {
  for (std::size_t i = 0; i < kRosTopics; ++i) {
    const RosTopicPlan& wanted = topics_[i];
    if (wanted.name.empty()) continue;
    writers_[i] = std::make_unique<ros2::TopicWriter>(participant_, wanted.name, type_of(static_cast<RosTopic>(i)),
                                                      ros2::Qos{wanted.reliable, wanted.latched, wanted.depth});
  }
}

void RosWriters::wait_for_readers() const {
  const auto all_read = [&] {
    for (std::size_t i = 0; i < kRosTopics; ++i) {
      // What is kept for later readers need not wait for them.
      if (writers_[i] && !topics_[i].latched && writers_[i]->readers() == 0) return false;
    }
    return true;
  };
  const std::int64_t until = monotonic_ns() + static_cast<std::int64_t>(wait_s_ * 1e9);
  while (monotonic_ns() < until && !all_read()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

std::string RosWriters::refused() const {
  std::string all;
  for (std::size_t i = 0; i < kRosTopics; ++i) {
    const std::string policy = writers_[i] ? writers_[i]->refused() : "";
    if (policy.empty()) continue;
    all += (all.empty() ? "" : ", ") + fmt::format("{} ({})", name_of(static_cast<RosTopic>(i)), policy);
  }
  return all;
}

void RosWriters::sum_up(std::ostream& people, const std::string& head, std::uint64_t unsent) const {
  constexpr std::int64_t kWaitNs = 1'000'000'000;
  const std::int64_t until = monotonic_ns() + kWaitNs;
  bool all_have_it = true;
  for (const auto& writer : writers_) {
    if (writer)
      all_have_it = writer->wait_for_readers(std::max<std::int64_t>(until - monotonic_ns(), 0)) && all_have_it;
  }
  people << "ROS 2       " << head << '\n';
  for (std::size_t i = 0; i < kRosTopics; ++i) {
    if (!writers_[i]) continue;
    people << fmt::format("  /{:<32} {:>8} sent, {} reader{} at the end\n", topics_[i].name, sent_[i].load(),
                          writers_[i]->readers(), writers_[i]->readers() == 1 ? "" : "s");
  }
  if (const std::string asked = refused(); !asked.empty()) {
    people << "  readers asked for what is not offered: " << asked << "; see --ros-qos\n";
  }
  if (unsent > 0) people << fmt::format("  {} messages could not be sent: readers acknowledge too slowly\n", unsent);
  if (!all_have_it) people << "  readers had not acknowledged everything 1 s after the end\n";
}

}  // namespace berth::cli
