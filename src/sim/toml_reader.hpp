#pragma once

#include <toml++/toml.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "sim/geometry.hpp"

namespace berth::sim {

/// A table of a TOML file that is read key by key, every value checked. Whatever is wrong is an Error
/// "FILE:LINE: field 'table.key' is VALUE; what to do". finish() finds the keys that nobody asked for.
class TomlReader {
 public:
  /// Parses a file, which errors call `what`. The table lives as long as a reader of it.
  static TomlReader open(const std::string& path, const std::string& what = "scenario");

  bool has(const std::string& key) const;
  /// The value, or the default where the key is missing. Bounds are included.
  double number(const std::string& key, double otherwise, double low, double high);
  int integer(const std::string& key, int otherwise, int low, int high);
  bool boolean(const std::string& key, bool otherwise);
  std::string text(const std::string& key, const std::string& otherwise);
  /// One of `allowed`.
  std::string choice(const std::string& key, const std::string& otherwise, const std::vector<std::string>& allowed);
  /// An array of exactly as many numbers as `otherwise` has.
  std::vector<double> numbers(const std::string& key, const std::vector<double>& otherwise, double low, double high);
  Vec2 pair(const std::string& key, const Vec2& otherwise, double low, double high);
  Vec3 triple(const std::string& key, const Vec3& otherwise, double low, double high);
  /// Where a thing on a body is: position_m and rotation_deg (rotation(), degrees), both 0 by default.
  Pose pose();
  /// A table; an empty one where the key is missing.
  TomlReader table(const std::string& key);
  /// An array of tables, `[[key]]`; none where the key is missing.
  std::vector<TomlReader> tables(const std::string& key);

  /// Throws Error on a key that was never asked for.
  void finish() const;
  /// Throws the Error for a value that is wrong for another reason.
  [[noreturn]] void fail(const std::string& key, const std::string& remedy) const;
  const std::string& file() const { return file_; }
  /// The path of a file that is named in this one, relative to it unless it is absolute.
  std::string beside(const std::string& path) const;

 private:
  TomlReader(std::shared_ptr<const toml::table> root, const toml::table* table, std::string file, std::string prefix);
  const toml::node* find(const std::string& key);
  [[noreturn]] void fail(const toml::node& node, const std::string& key, const std::string& remedy) const;

  std::shared_ptr<const toml::table> root_;
  const toml::table* table_;
  std::string file_, prefix_;
  std::set<std::string> asked_;
};

}  // namespace berth::sim
