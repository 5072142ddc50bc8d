#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "berth/error.hpp"
#include "berth/marker.hpp"
#include "near_names.hpp"
#include "target/family_name.hpp"

namespace berth {
namespace {

// One line of the generated tables.
struct FamilyTable {
  const char* name;
  int border_width;
  int total_width;
  bool reversed_border;
  int min_hamming;
  int bits;
  int count;
  const signed char* bit_x;
  const signed char* bit_y;
  const signed char* turn;
  const u64* codes;
};

#include BERTH_FAMILIES_INC_FILE

constexpr std::size_t kFamilyCount = sizeof kFamilyTables / sizeof kFamilyTables[0];

std::unique_ptr<const MarkerFamily> make_family(const FamilyTable& table) {
  auto family = std::make_unique<MarkerFamily>();
  family->name = table.name;
  family->border_width = table.border_width;
  family->total_width = table.total_width;
  family->reversed_border = table.reversed_border;
  family->min_hamming = table.min_hamming;
  family->bit_x.assign(table.bit_x, table.bit_x + table.bits);
  family->bit_y.assign(table.bit_y, table.bit_y + table.bits);
  family->rotation.assign(table.turn, table.turn + table.bits);
  family->codes.assign(table.codes, table.codes + table.count);
  return family;
}

}  // namespace

const char* family_name_at(std::size_t index) { return index < kFamilyCount ? kFamilyTables[index].name : nullptr; }

const std::vector<std::string>& family_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const FamilyTable& table : kFamilyTables) result.emplace_back(table.name);
    return result;
  }();
  return names;
}

const MarkerFamily& family(std::string_view name) {
  // Immutable once made, and made only when asked for: the large families are half a megabyte each.
  static std::mutex mutex;
  static std::unique_ptr<const MarkerFamily> families[kFamilyCount];
  for (std::size_t i = 0; i < kFamilyCount; ++i) {
    if (name != kFamilyTables[i].name) continue;
    const std::lock_guard<std::mutex> lock(mutex);
    if (!families[i]) families[i] = make_family(kFamilyTables[i]);
    return *families[i];
  }
  const std::string unknown(name);
  throw Error("unknown marker family \"" + unknown + "\"; near names: " + near_names(unknown, family_names(), 3) +
              " (of " + std::to_string(kFamilyCount) + " families)");
}

}  // namespace berth
