#include "target/file_field.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "berth/error.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

constexpr double kMost_m = 1000;

}  // namespace

FileField FileField::open(const std::string& path, const std::string& what, const std::string& remedy) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(path + ": cannot read the " + what + "; check the path and its permissions");
  std::ostringstream text;
  text << in.rdbuf();
  if (in.bad()) throw Error(path + ": cannot read the " + what + "; is it a folder?");
  try {
    return {path, "", YAML::Load(text.str())};
  } catch (const YAML::Exception& error) {
    throw Error(path + ": not a YAML file (line " + std::to_string(error.mark.line + 1) + ": " + error.msg + "); " +
                remedy);
  }
}

void FileField::fail(const std::string& problem, const std::string& remedy) const {
  throw Error(path_ + ": " + name_ + ": " + problem + "; " + remedy);
}

FileField FileField::at(const std::string& key, const std::string& remedy) const {
  if (!node_.IsMap()) fail("not a map", remedy);
  FileField inner(path_, name_.empty() ? key : name_ + "." + key, node_[key]);
  if (!inner.node_) inner.fail("missing", remedy);
  return inner;
}

std::vector<FileField> FileField::items(const std::string& remedy) const {
  if (!node_.IsSequence()) fail("not a list", remedy);
  std::vector<FileField> all;
  for (std::size_t i = 0; i < node_.size(); ++i) {
    all.push_back(FileField(path_, name_ + "[" + std::to_string(i) + "]", node_[i]));
  }
  return all;
}

void FileField::allow_only(const std::vector<std::string>& keys) const {
  std::string known;
  for (const std::string& key : keys) known += (known.empty() ? "" : ", ") + key;
  if (!node_.IsMap()) fail("not a map", "give " + known);
  for (const auto& entry : node_) {
    const std::string key = entry.first.Scalar();
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      fail("unknown key \"" + key + "\"", "use " + known);
    }
  }
}

std::string FileField::text() const {
  if (!node_.IsScalar()) fail("not a single value", "give one value");
  return node_.Scalar();
}

double FileField::number() const {
  double value = 0;
  if (!parse_decimal(text(), value)) {
    fail("\"" + text() + "\" is not a finite number", "give a decimal number such as 0.15");
  }
  return value;
}

double FileField::number_or(const std::string& key, double otherwise) const {
  return has(key) ? at(key, "").number() : otherwise;
}

double FileField::metres() const {
  const double value = number();
  if (!(std::fabs(value) <= kMost_m)) fail(shortest_decimal(value) + " m is out of bounds", "give metres");
  return value;
}

double FileField::metres_or(const std::string& key, double otherwise) const {
  return has(key) ? at(key, "").metres() : otherwise;
}

}  // namespace berth
