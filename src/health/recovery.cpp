#include "health/recovery.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "berth/error.hpp"
#include "monotonic.hpp"
#include "pipeline/thread_setup.hpp"

namespace berth {
namespace {

RecoveryConfig checked(const RecoveryConfig& config) {
  if (!config.open) throw Error("a recovery that opens no backend; give it a function that does");
  if (config.first_wait_ns <= 0 || config.longest_wait_ns < config.first_wait_ns) {
    throw Error("a recovery that waits " + std::to_string(config.first_wait_ns) + " to " +
                std::to_string(config.longest_wait_ns) + " ns; give more than 0, and no less for the longest");
  }
  if (config.right_answers < 1 || config.most_returns < 1) {
    throw Error("a recovery by " + std::to_string(config.right_answers) + " right answers, " +
                std::to_string(config.most_returns) + " times; give 1 or more of each");
  }
  return config;
}

}  // namespace

Recovery::Recovery(const RecoveryConfig& config, std::size_t backends, Make make)
    : config_(checked(config)), make_(std::move(make)), states_(backends) {
  for (State& state : states_) state.wait_ns = config_.first_wait_ns;
  thread_ = std::thread([this] { work(); });
}

Recovery::~Recovery() {
  stop();
  // What the younger displaced is of the older ones' backends.
  while (!kept_.empty()) kept_.pop_back();
}

void Recovery::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void Recovery::put_off(State& state) {
  state.due_ns = monotonic_ns() + state.wait_ns;
  state.wait_ns = std::min(2 * state.wait_ns, config_.longest_wait_ns);
}

void Recovery::wish(std::size_t backend) {
  const std::lock_guard<std::mutex> lock(mutex_);
  State& state = states_[backend];
  if (state.is_wished) return;
  if (state.returns == config_.most_returns) {
    ++given_up_;
    return;
  }
  state.is_wished = true;
  ++waited_for_;
  put_off(state);
  changed_.notify_all();
}

void Recovery::taken() {
  const std::lock_guard<std::mutex> lock(mutex_);
  State& state = states_[proven()->number];
  state.is_wished = false;
  ++state.returns;
  --waited_for_;
  ++returns_;
  proven_.store(nullptr, std::memory_order_release);
  changed_.notify_all();
}

/// The one that is due first; how many there are where none is wished for.
std::size_t Recovery::next() const {
  std::size_t first = states_.size();
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (!states_[i].is_wished) continue;
    if (first == states_.size() || states_[i].due_ns < states_[first].due_ns) first = i;
  }
  return first;
}

void Recovery::work() {
  name_thread("berth-recovery");
  make_background();
  std::unique_lock<std::mutex> lock(mutex_);
  while (!ending_) {
    const std::size_t backend = next();
    if (backend == states_.size() || proven() != nullptr) {
      changed_.wait(lock);
      continue;
    }
    const std::int64_t left_ns = states_[backend].due_ns - monotonic_ns();
    if (left_ns > 0) {
      changed_.wait_for(lock, std::chrono::nanoseconds(left_ns));
      continue;
    }
    lock.unlock();
    free_old();
    std::unique_ptr<Returned> found = attempt(backend);
    lock.lock();
    ++tries_;
    if (found == nullptr) {
      put_off(states_[backend]);
      continue;
    }
    kept_.push_back(std::move(found));
    proven_.store(kept_.back().get(), std::memory_order_release);
  }
}

/// Null where it cannot be opened, or does not answer rightly every time.
std::unique_ptr<Returned> Recovery::attempt(std::size_t backend) {
  try {
    std::unique_ptr<Returned> found = make_(config_.open(backend));
    found->number = backend;
    for (int i = 0; i < config_.right_answers; ++i) {
      if (!found->is_right()) return nullptr;
    }
    return found;
  } catch (const std::exception&) {
    return nullptr;  // whatever a driver that was lost may come to: it is tried again
  }
}

/// What is in no frame's use any more goes, so that a driver has room for what comes.
void Recovery::free_old() {
  for (std::size_t i = kept_.size(); i-- > 0;) {
    if (kept_[i] == nullptr || !kept_[i]->is_settled()) continue;
    kept_[i]->free_displaced();
    // Younger ones first: they have what the older ones' backends made.
    for (std::size_t older = i; older-- > 0;) {
      if (kept_[older] != nullptr && kept_[older]->number == kept_[i]->number) kept_[older].reset();
    }
  }
  kept_.erase(std::remove(kept_.begin(), kept_.end(), nullptr), kept_.end());
}

}  // namespace berth
