#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"

namespace berth {

/// Where a bit turns over.
enum class ChaosRegion {
  /// The camera's image, before anybody copied it: what two backends have in common.
  image,
  /// One backend's copy of it.
  pixels,
  /// What a step has just written and a later one reads, of the part that the frame uses.
  intermediate,
  /// Contours, quadrilaterals and edges, before the host reads them.
  results,
  /// One detector's code book, layout and configuration.
  tables,
  /// One detector's list of launches and their parameters.
  launches,
};
constexpr std::size_t kChaosRegions = 6;
/// Flips of one region in a row.
constexpr u64 kChaosRun = 20;
const char* name_of(ChaosRegion region);

/// What became of a region's flips. Those that changed a frame's result (status, codes, corners, poses) are told apart
/// by who noticed, the first of these that did.
struct ChaosTally {
  u64 flips = 0;
  /// The result was the same.
  u64 masked = 0;

  /// Without lockstep: the frame's status said so; the process ended or hung; checked memory or the known answer told
  /// right after; nobody did. `wrong_pose` is of the last, `late_wrong_pose` of those before.
  u64 by_status = 0, by_crash = 0, by_scrub = 0, by_known_answer = 0, silent = 0;
  u64 late_wrong_pose = 0, wrong_pose = 0;

  /// With lockstep: seen on the frame itself, or by status or crash; only later; by nobody.
  u64 in_lockstep = 0, lockstep_late = 0, lockstep_silent = 0;
  u64 lockstep_wrong_pose = 0;
  /// Masked, and seen all the same.
  u64 seen_masked = 0;
};

struct ChaosReport {
  u64 seed = 1;
  /// How many flips are done: flip i is the same in every campaign of a seed by one build, but what an altered index or
  /// address leads to may be another.
  u64 flips = 0;
  std::array<ChaosTally, kChaosRegions> regions;

  ChaosTally total() const;
};

/// A campaign of single bit flips: each hits one frame (memory that nobody writes: from that frame on) of one of two
/// detectors in lockstep, in a child of this process that ends with the first one that leaves a trace, so that what a
/// flip destroys, no other sees.
class ChaosCampaign {
 public:
  /// On a backend that works in the host's memory and on the caller's thread; others do not survive in a child. Throws
  /// Error.
  explicit ChaosCampaign(Backend& backend);
  ~ChaosCampaign();

  /// Flips from number report.flips on go into the report, as many as one child takes, until it has `most`. Throws
  /// Error where no child can be started.
  void next(ChaosReport& report, u64 most);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
