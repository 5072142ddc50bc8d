#include "golden/lines.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <sstream>

#include "berth/error.hpp"
#include "target/number_text.hpp"

namespace berth::golden {
namespace {

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line.substr(std::min(line.size(), line.find(": ") + 2)));
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::string name_in(const std::string& line) { return line.substr(0, line.find(": ")); }

std::string difference(const std::string& expected, const std::string& found) {
  if (name_in(expected) != name_in(found)) {
    return "'" + name_in(found) + "' where there should be '" + name_in(expected) + "'";
  }
  const std::vector<std::string> a = words_of(expected), b = words_of(found);
  std::size_t i = 0;
  while (i < a.size() && i < b.size() && a[i] == b[i]) ++i;
  const auto word = [i](const std::vector<std::string>& words) { return i < words.size() ? words[i] : "nothing"; };
  return name_in(expected) + ", value " + std::to_string(i + 1) + " of " + std::to_string(a.size()) + ": " + word(b) +
         " instead of " + word(a);
}

}  // namespace

void Lines::numbers(const std::string& name, const double* values, std::size_t count) {
  std::string line = name + ":";
  for (std::size_t i = 0; i < count; ++i) line += " " + shortest_decimal(values[i]);
  lines_.push_back(line);
}

void Lines::digest(const std::string& name, const double* values, std::size_t count) {
  u64 hash = 0xcbf29ce484222325u;
  for (std::size_t i = 0; i < count; ++i) {
    u64 bits = 0;
    std::memcpy(&bits, values + i, sizeof bits);
    hash = (hash ^ bits) * 0x100000001b3u;
  }
  digest(name, hash);
}

void Lines::digest(const std::string& name, u64 digest) {
  std::ostringstream line;
  line << name << ": 0x" << std::hex << digest;
  lines_.push_back(line.str());
}

void Lines::integers(const std::string& name, const std::vector<long long>& values) {
  std::string line = name + ":";
  for (const long long value : values) line += " " + std::to_string(value);
  lines_.push_back(line);
}

std::vector<std::string> read_lines(const std::string& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty() && line[0] != '#') lines.push_back(line);
  }
  if (lines.empty()) throw Error(path + ": no golden values there; the build's target golden_file writes them");
  return lines;
}

std::string first_difference(const std::vector<std::string>& expected, const std::vector<std::string>& found) {
  const std::size_t both = std::min(expected.size(), found.size());
  for (std::size_t i = 0; i < both; ++i) {
    if (expected[i] != found[i]) return difference(expected[i], found[i]);
  }
  if (expected.size() > both) return "nothing where there should be '" + name_in(expected[both]) + "'";
  if (found.size() > both) return "'" + name_in(found[both]) + "' where there should be nothing";
  return "";
}

}  // namespace berth::golden
