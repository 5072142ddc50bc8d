#pragma once

#include <cstdint>
#include <string>

#include "berth/camera.hpp"
#include "berth/source.hpp"
#include "berth/types.hpp"

namespace berth {

/// In recordings of `berth run`: the metadata record with the settings, the camera's place in it, and the topic of the
/// frames' records, and what that of their pictures begins with (docs/recording.md).
inline constexpr const char *kRunMetadata = "berth", *kCameraSetting = "camera", *kRecordTopic = "/berth/record",
                            *kImageTopic = "/berth/image";

/// A camera as a recording's settings hold it: exactly.
std::string recorded_camera_text(const CameraModel& camera);
/// Throws Error, which begins with `name`, on anything else.
CameraModel read_recorded_camera(const std::string& text, const std::string& name);

/// What a recording holds of a frame beside its picture.
struct RecordedFrame {
  /// Stamp but for the clock, label and truth; no image.
  SourceFrame frame;
  std::string clock;
  /// Frames before this one that could not be recorded.
  u64 missed = 0;
};

/// Throws Error, which begins with `name`, where it is no frame's record.
RecordedFrame read_recorded_frame(const std::string& text, const std::string& name);

}  // namespace berth
