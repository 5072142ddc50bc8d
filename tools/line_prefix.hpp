#pragma once

#include <mutex>
#include <ostream>
#include <streambuf>
#include <string>
#include <utility>

namespace berth::cli {

/// Whole lines of several threads on one stream, each with its writer's name before it: "dock   TEXT".
class LinePrefix final : public std::streambuf {
 public:
  /// `mutex`: shared by all who write to `out`.
  LinePrefix(std::string prefix, std::ostream& out, std::mutex& mutex)
      : prefix_(std::move(prefix)), out_(out), mutex_(mutex), line_(prefix_) {}
  ~LinePrefix() override {
    if (line_.size() > prefix_.size()) overflow('\n');
  }
  LinePrefix(const LinePrefix&) = delete;
  LinePrefix& operator=(const LinePrefix&) = delete;

 private:
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    line_ += traits_type::to_char_type(c);
    if (c != '\n') return c;
    const std::lock_guard lock(mutex_);
    out_ << line_ << std::flush;
    line_ = prefix_;
    return out_ ? c : traits_type::eof();
  }

  const std::string prefix_;
  std::ostream& out_;
  std::mutex& mutex_;
  std::string line_;
};

}  // namespace berth::cli
