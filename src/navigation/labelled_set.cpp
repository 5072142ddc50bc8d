#include "navigation/labelled_set.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>

#include "berth/error.hpp"

namespace berth {
namespace {

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

/// A row's fields by the header's names.
class Row {
 public:
  Row(const std::map<std::string, std::size_t>& columns, std::vector<std::string> fields, std::string where)
      : columns_(columns), fields_(std::move(fields)), where_(std::move(where)) {}

  const std::string& text(const char* name) const {
    const auto column = columns_.find(name);
    if (column == columns_.end()) throw Error(where_ + ": no column '" + name + "'; make the set again");
    if (column->second >= fields_.size())
      throw Error(where_ + ": the line ends before '" + name + "'; make the set again");
    return fields_[column->second];
  }
  double number(const char* name) const {
    const std::string& field = text(name);
    char* end = nullptr;
    const double value = std::strtod(field.c_str(), &end);
    if (field.empty() || *end != '\0') {
      throw Error(where_ + ": field '" + name + "' is '" + field + "', not a number; make the set again");
    }
    return value;
  }
  /// A column or row of an image.
  int pixel(const char* name, int side) const {
    const double value = number(name);
    if (!(value >= 0 && value < side)) {
      throw Error(where_ + ": field '" + name + "' is " + text(name) + ", not within the image's " +
                  std::to_string(side) + " px; make the set again");
    }
    return static_cast<int>(value);
  }

 private:
  const std::map<std::string, std::size_t>& columns_;
  std::vector<std::string> fields_;
  std::string where_;
};

}  // namespace

LabelledSet::LabelledSet(const std::string& folder, const std::string& part, int side)
    : path_(folder + "/images.u8"), image_bytes_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side)) {
  const std::string labels = folder + "/labels.csv";
  std::ifstream file(labels);
  std::string line;
  if (!file || !std::getline(file, line)) {
    throw Error(labels + ": cannot be read; make a set with berth_navset (training/README.md)");
  }
  std::map<std::string, std::size_t> columns;
  for (const std::string& name : fields_of(line)) columns.emplace(name, columns.size());
  std::size_t number = 1;
  std::size_t last = 0;
  while (std::getline(file, line)) {
    const Row row(columns, fields_of(line), labels + ", line " + std::to_string(++number));
    const double index = row.number("index");
    if (!(index >= 0 && index < 1e9))
      throw Error(labels + ", line " + std::to_string(number) + ": index " + row.text("index"));
    last = std::max(last, static_cast<std::size_t>(index));
    if (part != "all" && row.text("part") != part) continue;
    LabelledImage image;
    image.index = static_cast<std::size_t>(index);
    image.present = row.number("class") > 0;
    image.subject = row.text("subject");
    image.visible = row.number("visible");
    image.d = row.number("d_px");
    image.x = row.number("x");
    image.y = row.number("y");
    image.depth_m = row.number("depth_m");
    image.box = {row.pixel("x0", side), row.pixel("y0", side), row.pixel("x1", side), row.pixel("y1", side)};
    if (image.box[2] < image.box[0] || image.box[3] < image.box[1]) {
      throw Error(labels + ", line " + std::to_string(number) + ": the box ends before it begins; make the set again");
    }
    image.light = row.text("light");
    image.background = row.text("background");
    image.livery = row.text("livery");
    images_.push_back(image);
  }
  if (images_.empty()) throw Error(labels + ": has no image of the part '" + part + "'; the parts are train and test");
  std::ifstream pixels(path_, std::ios::binary | std::ios::ate);
  const std::size_t needed = (last + 1) * image_bytes_;
  if (!pixels || static_cast<std::size_t>(pixels.tellg()) < needed) {
    throw Error(path_ + ": does not have the " + std::to_string(needed) + " bytes of " + std::to_string(last + 1) +
                " images; make the set again");
  }
}

void LabelledSet::read(const LabelledImage& image, u8* pixels) const {
  std::ifstream file(path_, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(image.index * image_bytes_));
  if (!file.read(reinterpret_cast<char*>(pixels), static_cast<std::streamsize>(image_bytes_))) {
    throw Error(path_ + ": image " + std::to_string(image.index) + " cannot be read");
  }
}

}  // namespace berth
