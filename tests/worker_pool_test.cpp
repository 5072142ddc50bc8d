// Threads that share an operation's groups: every group once, whoever calls at the same time.
#include "host/worker_pool.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

namespace berth::host {
namespace {

/// Whether `rounds` operations of 1 to 40 groups each ran every group once.
bool runs_every_group_once(WorkerPool& pool, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    const int groups = 1 + round % 40;
    std::vector<std::atomic<int>> times(static_cast<std::size_t>(groups));
    pool.share(groups, [&](int first, int last) {
      for (int i = first; i < last; ++i) ++times[static_cast<std::size_t>(i)];
    });
    if (std::any_of(times.begin(), times.end(), [](const std::atomic<int>& n) { return n != 1; })) return false;
  }
  return true;
}

TEST(WorkerPool, RunsEveryGroupOnce) {
  for (const int threads : {1, 2, 3, 7}) {
    WorkerPool pool(threads);
    EXPECT_TRUE(runs_every_group_once(pool, 200)) << threads;
  }
}

TEST(WorkerPool, ServesSeveralCallersAtOnce) {
  WorkerPool pool(3);
  std::atomic<int> right = 0;
  std::vector<std::thread> callers;
  for (int i = 0; i < 3; ++i) callers.emplace_back([&] { right += runs_every_group_once(pool, 500) ? 1 : 0; });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(right, 3);
}

}  // namespace
}  // namespace berth::host
