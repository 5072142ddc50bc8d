#include "sim/toml_reader.hpp"

#include <algorithm>
#include <fstream>
#include <locale>
#include <sstream>

#include "berth/error.hpp"

namespace berth::sim {
namespace {

template <class T>
std::string plain(const T& value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << value;
  return text.str();
}

std::string value_text(const toml::node& node) {
  if (node.is_table()) return "a table";
  if (const auto* value = node.as_string()) return "\"" + value->get() + "\"";
  if (const auto* value = node.as_integer()) return plain(value->get());
  if (const auto* value = node.as_floating_point()) return plain(value->get());
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  if (const auto* array = node.as_array()) {
    std::string text = "[";
    for (const toml::node& element : *array) text += (text.size() > 1 ? ", " : "") + value_text(element);
    return text + "]";
  }
  return "a date or time";
}

std::string range_text(double low, double high) { return "from " + plain(low) + " to " + plain(high); }

}  // namespace

TomlReader::TomlReader(std::shared_ptr<const toml::table> root, const toml::table* table, std::string file,
                       std::string prefix)
    : root_(std::move(root)), table_(table), file_(std::move(file)), prefix_(std::move(prefix)) {}

TomlReader TomlReader::open(const std::string& path, const std::string& what) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw Error(path + ": the " + what + " cannot be read; check the path and its permissions");
  std::ostringstream text;
  text << stream.rdbuf();
  // A folder opens and then does not read.
  if (stream.bad() || text.str().empty())
    throw Error(path + ": the " + what + " is empty or not a file; name a TOML file");
  try {
    auto root = std::make_shared<const toml::table>(toml::parse(text.str(), path));
    const toml::table* table = root.get();
    return TomlReader(std::move(root), table, path, "");
  } catch (const toml::parse_error& error) {
    throw Error(path + ":" + std::to_string(error.source().begin.line) +
                ": not TOML: " + std::string(error.description()) + "; see https://toml.io for the syntax");
  }
}

void TomlReader::fail(const toml::node& node, const std::string& key, const std::string& remedy) const {
  throw Error(file_ + ":" + std::to_string(node.source().begin.line) + ": field '" + prefix_ + key + "' is " +
              value_text(node) + "; " + remedy);
}

void TomlReader::fail(const std::string& key, const std::string& remedy) const {
  const toml::node* node = table_ != nullptr ? table_->get(key) : nullptr;
  if (node != nullptr) fail(*node, key, remedy);
  throw Error(file_ + ": field '" + prefix_ + key + "' is missing; " + remedy);
}

const toml::node* TomlReader::find(const std::string& key) {
  asked_.insert(key);
  return table_ != nullptr ? table_->get(key) : nullptr;
}

bool TomlReader::has(const std::string& key) const { return table_ != nullptr && table_->contains(key); }

double TomlReader::number(const std::string& key, double otherwise, double low, double high) {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  if (!node->is_number()) fail(*node, key, "give a number " + range_text(low, high));
  const double value = *node->value<double>();
  if (!(value >= low && value <= high)) fail(*node, key, "use a value " + range_text(low, high));
  return value;
}

int TomlReader::integer(const std::string& key, int otherwise, int low, int high) {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  if (!node->is_integer()) fail(*node, key, "give a whole number " + range_text(low, high));
  const std::int64_t value = *node->value<std::int64_t>();
  if (value < low || value > high) fail(*node, key, "use a whole number " + range_text(low, high));
  return static_cast<int>(value);
}

bool TomlReader::boolean(const std::string& key, bool otherwise) {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  if (!node->is_boolean()) fail(*node, key, "use true or false");
  return *node->value<bool>();
}

std::string TomlReader::text(const std::string& key, const std::string& otherwise) {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  if (!node->is_string()) fail(*node, key, "give a text in quotes");
  return *node->value<std::string>();
}

std::string TomlReader::choice(const std::string& key, const std::string& otherwise,
                               const std::vector<std::string>& allowed) {
  std::string value = text(key, otherwise);
  if (std::find(allowed.begin(), allowed.end(), value) != allowed.end()) return value;
  std::string all;
  for (const std::string& one : allowed) all += (all.empty() ? "\"" : ", \"") + one + "\"";
  fail(key, "use one of " + all);
}

std::vector<double> TomlReader::numbers(const std::string& key, const std::vector<double>& otherwise, double low,
                                        double high) {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  const std::string wanted = std::to_string(otherwise.size()) + " numbers " + range_text(low, high);
  const toml::array* array = node->as_array();
  if (array == nullptr || array->size() != otherwise.size()) fail(*node, key, "give an array of " + wanted);
  std::vector<double> values;
  for (const toml::node& element : *array) {
    if (!element.is_number()) fail(*node, key, "give an array of " + wanted);
    const double value = *element.value<double>();
    if (!(value >= low && value <= high)) fail(*node, key, "use " + wanted);
    values.push_back(value);
  }
  return values;
}

Vec2 TomlReader::pair(const std::string& key, const Vec2& otherwise, double low, double high) {
  const std::vector<double> values = numbers(key, {otherwise[0], otherwise[1]}, low, high);
  return {values[0], values[1]};
}

Vec3 TomlReader::triple(const std::string& key, const Vec3& otherwise, double low, double high) {
  const std::vector<double> values = numbers(key, {otherwise[0], otherwise[1], otherwise[2]}, low, high);
  return {values[0], values[1], values[2]};
}

Pose TomlReader::pose() {
  const Vec3 at = triple("position_m", {0, 0, 0}, -20, 20);
  const Vec3 angles = triple("rotation_deg", {0, 0, 0}, -180, 180);
  Pose pose = translation(at[0], at[1], at[2]);
  pose.R = rotation(radians(angles[0]), radians(angles[1]), radians(angles[2]));
  return pose;
}

TomlReader TomlReader::table(const std::string& key) {
  const toml::node* node = find(key);
  if (node != nullptr && !node->is_table()) fail(*node, key, "make it a table: [" + prefix_ + key + "]");
  return TomlReader(root_, node != nullptr ? node->as_table() : nullptr, file_, prefix_ + key + ".");
}

std::vector<TomlReader> TomlReader::tables(const std::string& key) {
  std::vector<TomlReader> result;
  const toml::node* node = find(key);
  if (node == nullptr) return result;
  const toml::array* array = node->as_array();
  const bool all_tables = array != nullptr && std::all_of(array->begin(), array->end(),
                                                          [](const toml::node& element) { return element.is_table(); });
  if (!all_tables) fail(*node, key, "make it an array of tables: [[" + prefix_ + key + "]]");
  for (std::size_t i = 0; i < array->size(); ++i) {
    const std::string name = prefix_ + key + "[" + std::to_string(i) + "].";
    result.push_back(TomlReader(root_, array->get(i)->as_table(), file_, name));
  }
  return result;
}

void TomlReader::finish() const {
  if (table_ == nullptr) return;
  const auto unknown = std::find_if(table_->begin(), table_->end(), [&](const auto& entry) {
    return asked_.count(std::string(entry.first.str())) == 0;
  });
  if (unknown == table_->end()) return;
  const toml::key& key = unknown->first;
  std::string message = file_ + ":" + std::to_string(key.source().begin.line) + ": field '" + prefix_;
  message.append(key.str()).append("' is unknown here; remove it or use one of ");
  for (const std::string& one : asked_) message.append(one == *asked_.begin() ? "" : ", ").append(one);
  throw Error(message);
}

std::string TomlReader::beside(const std::string& path) const {
  const std::size_t slash = file_.find_last_of('/');
  return path[0] == '/' || slash == std::string::npos ? path : file_.substr(0, slash + 1) + path;
}

}  // namespace berth::sim
