#pragma once

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>

namespace berth::cli {

/// While it lives, the first SIGINT (Ctrl-C) or SIGTERM (a service's end, a container's) asks the stream to end; a
/// second one has its usual effect. Those that are made while another lives, on whichever thread, share that one's
/// signal; it must outlive them.
class InterruptWatch {
 public:
  InterruptWatch() : is_first_(living_++ == 0) {
    if (!is_first_) return;
    interrupted_ = 0;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      previous_[i] = std::signal(kSignals[i], [](int) {
        interrupted_ = 1;
        for (const int signal : kSignals) std::signal(signal, SIG_DFL);
      });
    }
  }
  ~InterruptWatch() {
    if (is_first_) {
      for (std::size_t i = 0; i < kSignals.size(); ++i) std::signal(kSignals[i], previous_[i]);
    }
    --living_;
  }
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;
  bool came() const { return interrupted_ != 0; }
  /// As if a signal had come; from any thread.
  static void ask() { interrupted_ = 1; }

 private:
  static constexpr std::array kSignals = {SIGINT, SIGTERM};
  static inline volatile std::sig_atomic_t interrupted_ = 0;
  static inline std::atomic<int> living_ = 0;
  const bool is_first_;
  std::array<void (*)(int), kSignals.size()> previous_ = {};
};

}  // namespace berth::cli
