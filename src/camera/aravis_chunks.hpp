#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "camera/aravis_finder.hpp"

namespace berth {

/// The time that a camera sends with each frame as chunk data, beside the one in the frame's head: GenICam's chunk
/// "Timestamp", of the event FrameStart.
/// Source: GenICam Standard Features Naming Convention 2.7, "Chunk Data Control".
class ChunkTime {
 public:
  /// Has the camera send it with the frames from now on, which makes them larger. Throws Error "aravis:NAME: …" where
  /// it cannot.
  ChunkTime(ArvCamera* camera, const std::string& name);
  /// On the camera's clock, ns; none where the frame came without.
  std::optional<std::int64_t> of(ArvBuffer* buffer) const;

 private:
  Object<ArvChunkParser> parser_;
  std::uint64_t ticks_per_second_ = 1'000'000'000;
};

}  // namespace berth
