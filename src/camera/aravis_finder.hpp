#pragma once

// GLib's types, for the files that know Aravis alone.
#include <arv.h>

#include <memory>
#include <string>

namespace berth {

/// A camera that is there answers within this time.
constexpr int kAnswerMs = 100;

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, Unref>;

/// What a call has to say where it fails.
class Failure {
 public:
  Failure() = default;
  ~Failure() { g_clear_error(&error_); }
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  /// For the call to write to; what an earlier one said is gone.
  GError** put() {
    g_clear_error(&error_);
    return &error_;
  }
  explicit operator bool() const { return error_ != nullptr; }
  std::string because() const { return error_ == nullptr ? "" : std::string(" (") + error_->message + ")"; }

 private:
  GError* error_ = nullptr;
};

/// Finds a camera by its name, again and again.
class AravisFinder {
 public:
  explicit AravisFinder(std::string name);
  /// Throws Error "aravis:NAME: …".
  Object<ArvCamera> open();

 private:
  [[noreturn]] void fail(const std::string& why) const;
  void look();

  const std::string name_;
  /// Of the camera last seen by that name: Aravis' name, and where it is if in the network.
  std::string id_, address_;
  int attempts_ = 0;
};

}  // namespace berth
