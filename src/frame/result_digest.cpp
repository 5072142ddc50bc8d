#include "frame/result_digest.hpp"

#include <array>

#include "frame/digest.hpp"

namespace berth {
u64 digest_of(const FrameResult& result) {
  const u32 status = static_cast<u32>(result.status);
  u64 digest = digest_words(&status, 1);
  for (const Detection& d : result.detections) {
    const u32 id = static_cast<u32>(d.id);
    digest = digest_words(&id, 1, digest);
    for (const auto& corner : d.corners) {
      for (const double value : corner) digest = digest_number(value, digest);
    }
    if (!d.has_pose) continue;
    for (const double value : d.pose.R) digest = digest_number(value, digest);
    for (const double value : d.pose.t) digest = digest_number(value, digest);
  }
  for (const BundlePose& bundle : result.bundles) {
    if (!bundle.has_pose) continue;
    for (const double value : bundle.pose.R) digest = digest_number(value, digest);
    for (const double value : bundle.pose.t) digest = digest_number(value, digest);
  }
  for (const DiscPose& target : result.disc_targets) {
    if (!target.has_pose) continue;
    for (const double value : target.pose.R) digest = digest_number(value, digest);
    for (const double value : target.pose.t) digest = digest_number(value, digest);
  }
  for (const StageDigest& stage : result.digests) {
    const std::array<u32, 2> words = {static_cast<u32>(stage.digest), static_cast<u32>(stage.digest >> 32)};
    digest = digest_words(words.data(), words.size(), digest);
  }
  return digest;
}

}  // namespace berth
