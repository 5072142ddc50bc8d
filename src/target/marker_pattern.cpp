#include "target/marker_pattern.hpp"

#include <string>

#include "berth/error.hpp"

namespace berth {

std::vector<u8> marker_pattern(const MarkerFamily& family, int id) {
  if (id < 0 || id >= static_cast<int>(family.codes.size())) {
    throw Error(family.name + " has no marker " + std::to_string(id) + "; ids are 0 to " +
                std::to_string(family.codes.size() - 1));
  }
  const int total = family.total_width;
  std::vector<u8> pattern(static_cast<std::size_t>(total) * static_cast<std::size_t>(total), u8{0});
  const auto light = [&](int x, int y) {
    pattern[static_cast<std::size_t>(y) * static_cast<std::size_t>(total) + static_cast<std::size_t>(x)] = 255;
  };
  const int offset = (total - family.border_width) / 2;

  // The light ring: just outside the border, or its outermost modules where the border is light inside.
  const int first = family.reversed_border ? offset : offset - 1;
  const int last = total - 1 - first;
  for (int i = first; i <= last; ++i) {
    light(i, first);
    light(i, last);
    light(first, i);
    light(last, i);
  }

  const std::size_t bits = family.bit_x.size();
  for (std::size_t i = 0; i < bits; ++i) {
    if ((family.codes[static_cast<std::size_t>(id)] >> (bits - 1 - i)) & 1) {
      light(family.bit_x[i] + offset, family.bit_y[i] + offset);
    }
  }
  return pattern;
}

}  // namespace berth
