#include "berth/detector.hpp"

#include <chrono>
#include <utility>

#include "berth/error.hpp"
#include "frame/digest.hpp"
#include "frame/marker_plan.hpp"
#include "frame/quads.hpp"
#include "frame/stages.hpp"
#include "target/decode.hpp"
#include "target/pose.hpp"

namespace berth {

const char* name_of(FrameStatus status) {
  switch (status) {
    case FrameStatus::ok:
      return "ok";
    case FrameStatus::no_target:
      return "no_target";
    case FrameStatus::overflow:
      return "overflow";
    case FrameStatus::late:
      return "late";
    case FrameStatus::device_lost:
      return "device_lost";
  }
  return "unknown";
}

namespace {

using Clock = std::chrono::steady_clock;

std::int64_t ns_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(to - from).count();
}

std::vector<const MarkerFamily*> find_families(const std::vector<std::string>& names) {
  if (names.empty()) throw Error("no marker family is asked for; name at least one, e.g. tag36h11");
  std::vector<const MarkerFamily*> families;
  for (const std::string& name : names) families.push_back(&family(name));
  return families;
}

}  // namespace

struct Detector::Impl {
  Impl(Backend& backend, int width, int height, const DetectorConfig& user_config)
      : config(user_config),
        decoder(find_families(config.families), config.max_hamming),
        plan(backend, MarkerGeometry(width, height, config.capacities), config),
        stream(backend.make_stream()) {
    if (config.camera && !(config.marker_size_m > 0)) {
      throw Error("marker size is " + std::to_string(config.marker_size_m) + " m; give the side that the corners span");
    }
    const MarkerGeometry& g = plan.geometry();
    const std::size_t slots = static_cast<std::size_t>(g.max_contours);
    if (plan.frame().host() == nullptr) staging.resize(g.frame_bytes());
    if (plan.quads().host() == nullptr) {
      contours.resize(plan.contours().bytes() / 4);
      quads.resize(slots * QUAD_WORDS);
      edges.resize(slots * EDGE_WORDS);
    }
    result.detections.reserve(slots);
  }

  u8* frame() { return staging.empty() ? static_cast<u8*>(plan.frame().host()) : staging.data(); }

  void submit(View2D<const u8> image, const FrameStamp& stamp) {
    const MarkerGeometry& g = plan.geometry();
    if (image.width != g.width || image.height != g.height) {
      throw Error("frame is " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                  "; this detector was made for " + std::to_string(g.width) + "x" + std::to_string(g.height));
    }
    started = Clock::now();
    result.stamp = stamp;
    pad_frame(image, g, frame());
    if (!staging.empty()) stream->upload(plan.frame(), staging.data(), staging.size());
    stream->replay(plan.plan());
    if (!quads.empty()) {
      stream->download(plan.contours(), contours.data(), contours.size() * 4);
      stream->download(plan.quads(), quads.data(), quads.size() * 4);
      stream->download(plan.edges(), edges.data(), edges.size() * 4);
    }
  }

  const FrameResult& collect() {
    const MarkerGeometry& g = plan.geometry();
    result.detections.clear();
    result.digests.clear();
    result.quads = 0;
    const bool alive = stream->finish();
    const Clock::time_point on_host = Clock::now();
    if (!alive) {
      result.status = FrameStatus::device_lost;
      return result;
    }
    const u32* header = contours.empty() ? static_cast<const u32*>(plan.contours().host()) : contours.data();
    decode(quads.empty() ? static_cast<const s32*>(plan.quads().host()) : quads.data(),
           edges.empty() ? static_cast<const s32*>(plan.edges().host()) : edges.data());
    const Clock::time_point decoded = Clock::now();
    if (config.camera) {
      for (Detection& detection : result.detections) {
        detection.has_pose = paper_p4p(*config.camera, config.marker_size_m, detection.corners, detection.pose);
      }
    }
    const Clock::time_point posed = Clock::now();
    result.capacities = {CapacityUse{"run_ends", header[0], static_cast<u32>(g.max_run_ends)},
                         CapacityUse{"contours", header[1], static_cast<u32>(g.max_contours)},
                         CapacityUse{"points", header[2], static_cast<u32>(g.max_points)}};
    result.times = {StageTime{"device", ns_between(started, on_host)}, StageTime{"decode", ns_between(on_host, decoded)},
                    StageTime{"pose", ns_between(decoded, posed)}};
    result.status = result.detections.empty() ? FrameStatus::no_target : FrameStatus::ok;
    for (const CapacityUse& use : result.capacities) {
      if (use.needed > use.capacity) result.status = FrameStatus::overflow;
    }
    if (config.digests) take_digests();
    return result;
  }

  void decode(const s32* quad, const s32* edge) {
    const MarkerGeometry& g = plan.geometry();
    const View2D<const u8> image{frame(), g.width, g.height, g.padded_width};
    for (int i = 0; i < g.max_contours; ++i, quad += QUAD_WORDS, edge += EDGE_WORDS) {
      if ((quad[0] & QUAD_VALID) == 0) continue;
      ++result.quads;
      QuadCandidate candidate;
      Detection detection;
      if (to_candidate(quad, edge, candidate) && decoder.decode(image, candidate, detection)) {
        result.detections.push_back(detection);
      }
    }
    resolve_duplicates(result.detections);
  }

  void take_digests() {
    StageReader reader(plan, *stream);
    for (std::size_t i = 0; i < plan.stages().size(); ++i) {
      const std::vector<u32>& words = reader.read(i);
      result.digests.push_back({plan.stages()[i].name, digest_words(words.data(), words.size())});
    }
  }

  DetectorConfig config;
  Decoder decoder;
  MarkerPlan plan;
  std::unique_ptr<Stream> stream;
  std::vector<u8> staging;  // empty where the host reaches the device's memory
  std::vector<u32> contours;
  std::vector<s32> quads;
  std::vector<s32> edges;
  FrameResult result;
  Clock::time_point started;
};

Detector::Detector(Backend& backend, int width, int height, const DetectorConfig& config)
    : impl_(std::make_unique<Impl>(backend, width, height, config)) {}
Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

void Detector::submit(View2D<const u8> image, const FrameStamp& stamp) { impl_->submit(image, stamp); }
const FrameResult& Detector::collect() { return impl_->collect(); }
const FrameResult& Detector::detect(View2D<const u8> image, const FrameStamp& stamp) {
  submit(image, stamp);
  return collect();
}
std::size_t Detector::device_bytes() const { return impl_->plan.device_bytes(); }

}  // namespace berth
