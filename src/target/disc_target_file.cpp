#include <array>
#include <string>
#include <vector>

#include "berth/disc_target.hpp"
#include "berth/error.hpp"
#include "target/file_field.hpp"

namespace berth {
namespace {

constexpr const char* kExample = "see docs/disc-targets.md for an example file";

}  // namespace

DiscTarget read_disc_target(const std::string& path) {
  const FileField root = FileField::open(path, "target file", kExample);
  const FileField field = root.at("disc_target", kExample);
  field.allow_only({"name", "deviation", "discs", "bars"});
  DiscTarget target;
  target.name = field.at("name", "give the target a name").text();
  target.deviation_m = field.metres_or("deviation", 0);
  for (const FileField& one : field.at("discs", kExample).items("list the discs")) {
    one.allow_only({"x", "y", "diameter", "hole"});
    const auto metres = [&](const char* key) { return one.at(key, "give metres").metres(); };
    target.discs.push_back({metres("x"), metres("y"), metres("diameter"), one.metres_or("hole", 0)});
  }
  if (field.has("bars")) {
    for (const FileField& one : field.at("bars", "").items("list the bars")) {
      one.allow_only({"from", "to", "width"});
      const auto point = [&](const char* key) {
        const FileField value = one.at(key, "give [x, y] in metres");
        const std::vector<FileField> two = value.items("give [x, y] in metres");
        if (two.size() != 2) value.fail("not two numbers", "give [x, y] in metres");
        return std::array<double, 2>{two[0].metres(), two[1].metres()};
      };
      target.bars.push_back({point("from"), point("to"), one.at("width", "give metres").metres()});
    }
  }
  try {
    target.check();
  } catch (const Error& error) {
    throw Error(path + ": " + error.what());
  }
  return target;
}

}  // namespace berth
