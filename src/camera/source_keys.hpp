#pragma once

#include <functional>
#include <string>
#include <vector>

namespace berth {

/// What a camera's name in --source says after its kind: "CAMERA[,KEY=VALUE...]". The numbers' readers throw Error that
/// names the key, its value and the remedy.
class SourceKeys {
 public:
  /// `kind`: "v4l2"; `known`: all keys, for messages.
  SourceKeys(std::string kind, std::string known) : kind_(std::move(kind)), known_(std::move(known)) {}

  /// Calls `set` for every key, which returns false where it does not know it. Returns the camera.
  std::string read(const std::string& text,
                   const std::function<bool(const std::string& key, const std::string& value)>& set) const;

  int whole(const std::string& key, const std::string& value, int least, int most) const;
  /// Above 0.
  double frames_per_second(const std::string& key, const std::string& value) const;
  double real(const std::string& key, const std::string& value, double least, double most) const;
  bool on_or_off(const std::string& key, const std::string& value) const;
  /// The value itself.
  std::string one_of(const std::string& key, const std::string& value, const std::vector<std::string>& known) const;
  [[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& remedy) const;
  /// Throws Error unless both are given or neither.
  void check_size(int width, int height) const;

 private:
  std::string kind_, known_;
};

}  // namespace berth
