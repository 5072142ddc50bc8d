#include "camera/aravis_chunks.hpp"

#include <algorithm>
#include <vector>

#include "berth/error.hpp"

namespace berth {
namespace {

constexpr const char *kChunk = "Timestamp", *kNode = "ChunkTimestamp";

[[noreturn]] void fail(const std::string& name, const std::string& what) {
  throw Error("aravis:" + name + ": " + what + "; leave timestamp=chunk out");
}

/// What the camera has of that enumeration.
std::vector<std::string> entries_of(ArvCamera* camera, const char* feature) {
  Failure ignored;
  unsigned count = 0;
  const char** names = arv_camera_dup_available_enumerations_as_strings(camera, feature, &count, ignored.put());
  std::vector<std::string> entries(names, names + (names == nullptr ? 0 : count));
  g_free(names);
  return entries;
}

}  // namespace

ChunkTime::ChunkTime(ArvCamera* camera, const std::string& name) {
  Failure failure;
  if (arv_camera_are_chunks_available(camera, failure.put()) == 0 || failure) {
    fail(name, "the camera sends no chunk data" + failure.because());
  }
  arv_camera_set_chunk_mode(camera, 1, failure.put());
  if (failure) fail(name, "the camera does not switch its chunk data on" + failure.because());
  const std::vector<std::string> chunks = entries_of(camera, "ChunkSelector");
  ArvDevice* device = arv_camera_get_device(camera);
  if (std::find(chunks.begin(), chunks.end(), kChunk) == chunks.end() ||
      arv_device_get_feature(device, kNode) == nullptr) {
    std::string all;
    for (const std::string& chunk : chunks) all += (all.empty() ? "" : ", ") + chunk;
    fail(name, std::string("the camera has no chunk ") + kChunk + "; it has " + (all.empty() ? "none" : all));
  }
  arv_camera_set_chunk_state(camera, kChunk, 1, failure.put());
  if (failure) fail(name, std::string("the camera does not send its chunk ") + kChunk + failure.because());
  parser_.reset(arv_camera_create_chunk_parser(camera));
  // USB3 Vision counts in ns, GigE Vision in ticks of the camera's own.
  if (arv_camera_is_gv_device(camera) == 0) return;
  ticks_per_second_ = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), failure.put());
  if (failure || ticks_per_second_ == 0) {
    fail(name, "the camera does not tell how fast its clock ticks" + failure.because());
  }
}

std::optional<std::int64_t> ChunkTime::of(ArvBuffer* buffer) const {
  if (arv_buffer_has_chunks(buffer) == 0) return std::nullopt;
  Failure failure;
  const auto ticks =
      static_cast<std::uint64_t>(arv_chunk_parser_get_integer_value(parser_.get(), buffer, kNode, failure.put()));
  if (failure) return std::nullopt;
  // In two parts: their product has more than 64 bits.
  constexpr std::uint64_t kSecond = 1'000'000'000;
  const std::uint64_t seconds = ticks / ticks_per_second_, rest = ticks % ticks_per_second_;
  return static_cast<std::int64_t>(seconds * kSecond + rest * kSecond / ticks_per_second_);
}

}  // namespace berth
