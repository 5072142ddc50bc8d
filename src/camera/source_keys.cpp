#include "camera/source_keys.hpp"

#include <algorithm>
#include <charconv>
#include <locale>
#include <sstream>

#include "camera/bad_input.hpp"

namespace berth {
namespace {

constexpr const char* kSource = "--source";

/// False unless all of the text is a number.
bool read_number(const std::string& text, double& number) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  stream >> number;
  return !stream.fail() && stream.eof();
}

std::string shown(double number) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << number;
  return stream.str();
}

}  // namespace

std::string SourceKeys::read(const std::string& text,
                             const std::function<bool(const std::string&, const std::string&)>& set) const {
  std::istringstream parts(text);
  std::string camera, part;
  std::getline(parts, camera, ',');
  while (std::getline(parts, part, ',')) {
    const std::size_t equals = part.find('=');
    if (equals == std::string::npos) refuse(part, "", "give KEY=VALUE; the keys are " + known_);
    const std::string key = part.substr(0, equals), value = part.substr(equals + 1);
    if (!set(key, value)) refuse(key, value, "the keys are " + known_);
  }
  return camera;
}

int SourceKeys::whole(const std::string& key, const std::string& value, int least, int most) const {
  int number = 0;
  const char* end = value.data() + value.size();
  const auto parsed = std::from_chars(value.data(), end, number);
  if (parsed.ec != std::errc() || parsed.ptr != end || number < least || number > most) {
    refuse(key, value, "give a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return number;
}

double SourceKeys::frames_per_second(const std::string& key, const std::string& value) const {
  double fps = 0;
  if (!read_number(value, fps) || !(fps > 0) || !(fps <= 10000)) {
    refuse(key, value, "give frames per second, above 0 and at most 10000");
  }
  return fps;
}

double SourceKeys::real(const std::string& key, const std::string& value, double least, double most) const {
  double number = 0;
  if (!read_number(value, number) || !(number >= least) || !(number <= most)) {
    refuse(key, value, "give a number from " + shown(least) + " to " + shown(most));
  }
  return number;
}

std::string SourceKeys::one_of(const std::string& key, const std::string& value,
                               const std::vector<std::string>& known) const {
  if (std::find(known.begin(), known.end(), value) != known.end()) return value;
  std::string all;
  for (const std::string& one : known) all += (all.empty() ? "" : ", ") + one;
  refuse(key, value, "give one of " + all);
}

bool SourceKeys::on_or_off(const std::string& key, const std::string& value) const {
  if (value != "on" && value != "off") refuse(key, value, "give on or off");
  return value == "on";
}

void SourceKeys::refuse(const std::string& key, const std::string& value, const std::string& remedy) const {
  throw bad_field(kSource, kind_ + ":…," + key, "'" + value + "'", remedy);
}

void SourceKeys::check_size(int width, int height) const {
  if ((width == 0) == (height == 0)) return;
  throw bad_field(kSource, kind_ + (width == 0 ? ":…,width" : ":…,height"), "missing",
                  "give width and height, or neither");
}

}  // namespace berth
