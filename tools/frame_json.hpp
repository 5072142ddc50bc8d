#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "berth/frame.hpp"
#include "berth/source.hpp"
#include "berth/tracker.hpp"

namespace berth::cli {

using Json = nlohmann::ordered_json;

/// {"family","id","hamming","margin","corners","center","pose"?}: docs/command.md.
Json to_json(const Detection& detection);
Json to_json(const std::vector<Detection>& detections);
Json to_json(const TruthMarker& marker);
/// Of every bundle that was asked for: name, how many of its markers went into the pose, the pose where there is one.
Json to_json(const std::vector<BundlePose>& poses, const std::vector<Bundle>& bundles);

/// Of every target of discs that was looked for: name, how many discs went into the pose, the pose where there is one,
/// and where each disc was seen.
Json to_json(const std::vector<DiscPose>& poses, const std::vector<DiscTarget>& targets);
Json to_json(const TruthTarget& target);

/// One frame of a stream's log. `label` names the frame in its source; truth and digests only where there are any.
Json to_json(const FrameResult& frame, const std::string& label, std::int64_t cpu_ns,
             const std::vector<TruthMarker>& truth);

/// How a frame was searched: {"whole","why","windows","held"}.
Json to_json(const TrackedFrame& tracked);

/// One line without its end. Doubles read back equal; bytes that are no UTF-8 become U+FFFD.
std::string to_line(const Json& json);

/// Nanoseconds as milliseconds.
inline double ms_of(std::int64_t ns) { return static_cast<double>(ns) / 1e6; }

}  // namespace berth::cli
