#pragma once

#include <csignal>

namespace berth::cli {

/// While it lives, the first SIGINT asks the stream to end; a second one has its usual effect. One at a time.
class InterruptWatch {
 public:
  InterruptWatch() {
    interrupted_ = 0;
    previous_ = std::signal(SIGINT, [](int) {
      interrupted_ = 1;
      std::signal(SIGINT, SIG_DFL);
    });
  }
  ~InterruptWatch() { std::signal(SIGINT, previous_); }
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;
  bool came() const { return interrupted_ != 0; }
  /// As if SIGINT had come; from any thread.
  static void ask() { interrupted_ = 1; }

 private:
  static inline volatile std::sig_atomic_t interrupted_ = 0;
  void (*previous_)(int);
};

}  // namespace berth::cli
