#pragma once

#include <functional>
#include <string>
#include <vector>

#include "navset/sample.hpp"

namespace berth::navset {

/// What a set is made of.
struct SetPlan {
  /// `paper-split`: training and test images from one pool. `disjoint`: the test's backgrounds, liveries and meshes are
  /// never seen in training. `look-alike`: one pool, all negatives are other satellites.
  /// `hard`: as `disjoint`, with small, hidden and dim targets (Conditions::hard).
  std::string name = "paper-split";
  u64 seed = 1;
  /// The paper's numbers; in each part 40 positives to 97 negatives.
  int train = 9590, test = 4110;

  int count() const { return train + test; }
  /// Throws Error on an unknown name or a number out of range.
  void check() const;
};

/// What came out: FNV-1a over all pixels, and over labels.csv.
struct SetResult {
  u64 image_hash = 0, label_hash = 0;
  int positives = 0;
  std::vector<int> backdrops_used;  ///< how many images each of the gallery's pictures is behind
};

/// The subject of each image, training part first, in an order shuffled by the seed.
std::vector<Subject> subjects(const SetPlan& plan);

/// Writes images.u8 (u8[count, 256, 256]) and labels.csv into an existing folder, the same bytes for any number of
/// threads. `progress` hears the number of images done, on the calling thread. Throws Error where writing fails.
SetResult write_set(const SetPlan& plan, const Gallery& gallery, const Studio& studio, int threads,
                    const std::string& folder, const std::function<void(int)>& progress);

}  // namespace berth::navset
