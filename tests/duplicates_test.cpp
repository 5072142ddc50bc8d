// Which of several detections of one place stays.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "target/decode.hpp"

namespace berth {
namespace {

Detection at(const char* name, int id, double x, double y, double side, int hamming, double margin) {
  Detection d;
  d.family = &family(name);
  d.id = id;
  d.hamming = hamming;
  d.margin = margin;
  d.corners = {{{x, y}, {x, y + side}, {x + side, y + side}, {x + side, y}}};
  d.center = {x + side / 2, y + side / 2};
  return d;
}

TEST(Duplicates, TheBestStaysWhateverTheOrder) {
  const std::vector<Detection> all = {
      at("tag36h11", 5, 10, 10, 40, 0, 60),     // best of three at this place
      at("tag36h11", 5, 10.5, 10, 40, 1, 90),   // more wrong bits
      at("tag36h11", 5, 10, 10.5, 40, 0, 59),   // less margin
      at("tag36h11", 5, 200, 10, 40, 0, 60),    // the same id elsewhere: two markers of one kind
      at("tag25h9", 1, 12, 12, 36, 2, 99),      // another reading of the first place
      at("tag25h9", 3, 100, 100, 100, 0, 50),   // a large marker
      at("tag36h11", 8, 145, 145, 10, 0, 50)};  // printed in its middle: not the same place
  std::vector<std::size_t> order(all.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  do {
    std::vector<Detection> list;
    for (const std::size_t i : order) list.push_back(all[i]);
    resolve_duplicates(list);
    ASSERT_EQ(list.size(), 4u);
    EXPECT_EQ(list[0].id, 3);
    EXPECT_EQ(list[1].id, 5);
    EXPECT_EQ(list[1].corners, all[0].corners);
    EXPECT_EQ(list[2].id, 5);
    EXPECT_EQ(list[2].corners, all[3].corners);
    EXPECT_EQ(list[3].id, 8);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(Duplicates, NothingStaysNothing) {
  std::vector<Detection> none;
  resolve_duplicates(none);
  EXPECT_TRUE(none.empty());
}

}  // namespace
}  // namespace berth
