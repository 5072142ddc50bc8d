#pragma once

#include <atomic>
#include <csignal>

namespace berth::cli {

/// While it lives, the first SIGINT asks the stream to end; a second one has its usual effect. Those that are made
/// while another lives, on whichever thread, share that one's signal; it must outlive them.
class InterruptWatch {
 public:
  InterruptWatch() : is_first_(living_++ == 0) {
    if (!is_first_) return;
    interrupted_ = 0;
    previous_ = std::signal(SIGINT, [](int) {
      interrupted_ = 1;
      std::signal(SIGINT, SIG_DFL);
    });
  }
  ~InterruptWatch() {
    if (is_first_) std::signal(SIGINT, previous_);
    --living_;
  }
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;
  bool came() const { return interrupted_ != 0; }
  /// As if SIGINT had come; from any thread.
  static void ask() { interrupted_ = 1; }

 private:
  static inline volatile std::sig_atomic_t interrupted_ = 0;
  static inline std::atomic<int> living_ = 0;
  const bool is_first_;
  void (*previous_)(int) = nullptr;
};

}  // namespace berth::cli
