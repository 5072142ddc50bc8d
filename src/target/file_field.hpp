#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <utility>
#include <vector>

namespace berth {

/// One value of a YAML (or JSON) file and where it stands. Whatever is wrong with it is an Error "FILE: FIELD: what is
/// wrong; what to do".
class FileField {
 public:
  /// The whole of a file. `what` names it ("bundle file") and `remedy` what would do. Throws Error where it cannot be
  /// read or is no YAML. The path must outlive the field and those in it.
  static FileField open(const std::string& path, const std::string& what, const std::string& remedy);

  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const;
  bool has(const std::string& key) const { return node_.IsMap() && static_cast<bool>(node_[key]); }
  FileField at(const std::string& key, const std::string& remedy) const;
  std::vector<FileField> items(const std::string& remedy) const;
  /// Throws Error on a key of the map that is none of these.
  void allow_only(const std::vector<std::string>& keys) const;

  std::string text() const;
  double number() const;
  double number_or(const std::string& key, double otherwise) const;
  /// A number within ±1000: what is beyond is in another unit.
  double metres() const;
  double metres_or(const std::string& key, double otherwise) const;

 private:
  FileField(const std::string& path, std::string name, const YAML::Node& node)
      : path_(path), name_(std::move(name)), node_(node) {}

  const std::string& path_;
  std::string name_;
  YAML::Node node_;
};

}  // namespace berth
