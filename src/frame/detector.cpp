#include "berth/detector.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "berth/error.hpp"
#include "frame/digest.hpp"
#include "frame/marker_plan.hpp"
#include "frame/quads.hpp"
#include "frame/stages.hpp"
#include "target/bent_sides.hpp"
#include "target/bundle_pose.hpp"
#include "target/decode.hpp"
#include "target/marker_pose.hpp"
#include "target/paper_p4p.hpp"
#include "target/photometric_fit.hpp"

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

/// The solvers of the bundles, which must be of these families and have no marker in common.
std::vector<BundlePoser> bundle_posers(const std::vector<Bundle>& bundles,
                                       const std::vector<const MarkerFamily*>& families) {
  std::vector<BundlePoser> posers;
  for (const Bundle& bundle : bundles) {
    bundle.check();
    for (const BundleMarker& marker : bundle.markers) {
      const std::string which = name_of(marker);
      if (std::find(families.begin(), families.end(), marker.family) == families.end()) {
        throw Error("bundle \"" + bundle.name + "\" has " + which + ", whose family is not looked for; add " +
                    marker.family->name + " to the families");
      }
      for (const BundlePoser& other : posers) {
        if (other.bundle().find(*marker.family, marker.id) == nullptr) continue;
        throw Error(which + " is in the bundles \"" + other.bundle().name + "\" and \"" + bundle.name +
                    "\"; keep it in one");
      }
    }
    posers.emplace_back(bundle);
  }
  return posers;
}

using Corners = std::array<std::array<double, 2>, 4>;

double square_distance(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
}

/// Whether every corner of a has one of b's within `tolerance` px, whichever comes first.
bool same_corners(const Corners& a, const Corners& b, double tolerance) {
  for (const auto& corner : a) {
    bool found = false;
    for (const auto& other : b) {
      found = found || square_distance(corner, other) < tolerance * tolerance;
    }
    if (!found) return false;
  }
  return true;
}

/// One search's results on the host: in the device's memory where the host reaches it, downloaded otherwise.
class SearchResult {
 public:
  explicit SearchResult(const MarkerSearch& search) : search_(search) {
    if (search.quads->host() != nullptr) return;
    contours_.resize(search.contours->bytes() / 4);
    quads_.resize(search.quads->bytes() / 4);
    edges_.resize(search.edges->bytes() / 4);
  }
  void download(Stream& stream) {
    if (quads_.empty()) return;
    stream.download(*search_.contours, contours_.data(), contours_.size() * 4);
    stream.download(*search_.quads, quads_.data(), quads_.size() * 4);
    stream.download(*search_.edges, edges_.data(), edges_.size() * 4);
  }

  /// How many slots the frame has filled.
  int slots() const { return static_cast<int>(std::min(header()[1], static_cast<u32>(search_.geometry.max_contours))); }
  /// Whether slot i holds a quadrilateral; `found` tells whether it has four corners.
  bool quad(int i, QuadCandidate& candidate, bool& found) const {
    const s32* quad =
        (quads_.empty() ? static_cast<const s32*>(search_.quads->host()) : quads_.data()) + i * QUAD_WORDS;
    const s32* edge =
        (edges_.empty() ? static_cast<const s32*>(search_.edges->host()) : edges_.data()) + i * EDGE_WORDS;
    if ((quad[0] & QUAD_VALID) == 0) return false;
    found = to_candidate(quad, edge, search_.scale, candidate);
    return true;
  }
  void note_capacities(CapacityUse* use) const {
    const MarkerGeometry& g = search_.geometry;
    use[0] = {search_.capacity_names[0], header()[0], static_cast<u32>(g.max_run_ends)};
    use[1] = {search_.capacity_names[1], header()[1], static_cast<u32>(g.max_contours)};
    use[2] = {search_.capacity_names[2], header()[2], static_cast<u32>(g.max_points)};
  }

 private:
  const u32* header() const {
    return contours_.empty() ? static_cast<const u32*>(search_.contours->host()) : contours_.data();
  }

  const MarkerSearch& search_;
  std::vector<u32> contours_;
  std::vector<s32> quads_;
  std::vector<s32> edges_;
};

}  // namespace

struct Detector::Impl {
  Impl(Backend& backend, int width, int height, const DetectorConfig& user_config)
      : config(user_config),
        families(find_families(config.families)),
        decoder(families, config.max_hamming),
        bundles(bundle_posers(config.bundles, families)),
        plan(backend, width, height, config),
        stream(backend.make_stream()) {
    if (config.camera && !(config.marker_size_m > 0) && (bundles.empty() || config.marker_size_m != 0)) {
      throw Error("marker size is " + std::to_string(config.marker_size_m) + " m; give the side that the corners span");
    }
    if (!(config.corner_deviation_px > 0)) {
      throw Error("corner_deviation_px is " + std::to_string(config.corner_deviation_px) + "; give px above 0");
    }
    is_bending = config.camera && (config.camera->lens != LensModel::radial_tangential ||
                                   config.camera->distortion != std::array<double, 8>{});
    if (config.corner_method == CornerMethod::photometric) fit.emplace(config.camera, width, height);
    if (plan.frame().host() == nullptr) staging.resize(plan.geometry().frame_bytes());
    std::size_t slots = 0;
    for (const MarkerSearch& search : plan.searches()) {
      searches.emplace_back(search);
      slots += static_cast<std::size_t>(search.geometry.max_contours);
    }
    result.detections.reserve(slots);
    result.bundles.resize(bundles.size());
    refused.reserve(slots);
    if (!staging.empty()) {  // drivers may finish compiling at the first launch: not in the first frame's time
      stream->replay(plan.plan());
      if (!stream->finish()) {
        throw Error(std::string(backend.name()) + ": " + backend.device().name +
                    " was lost on the first, empty frame; see berth doctor, or use another backend");
      }
    }
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
    for (SearchResult& search : searches) search.download(*stream);
  }

  const FrameResult& collect() {
    result.detections.clear();
    std::fill(result.bundles.begin(), result.bundles.end(), BundlePose{});
    refused.clear();
    result.digests.clear();
    result.quads = 0;
    const bool alive = stream->finish();
    const Clock::time_point on_host = Clock::now();
    if (!alive) {
      result.status = FrameStatus::device_lost;
      return result;
    }
    for (const SearchResult& search : searches) decode(search);
    resolve_duplicates(result.detections);
    if (is_bending) straighten();
    const Clock::time_point decoded = Clock::now();
    if (fit) refine_corners();
    const Clock::time_point refined = Clock::now();
    if (config.camera) {
      for (Detection& detection : result.detections) add_pose(detection);
      for (std::size_t i = 0; i < bundles.size(); ++i) {
        bundles[i].find(*config.camera, result.detections, config.corner_deviation_px, result.bundles[i]);
      }
    }
    const Clock::time_point posed = Clock::now();
    result.times = {StageTime{"device", ns_between(started, on_host)},
                    StageTime{"decode", ns_between(on_host, decoded)}, StageTime{"pose", ns_between(refined, posed)},
                    StageTime{fit ? "corners" : "", ns_between(decoded, refined)}};
    result.status = result.detections.empty() ? FrameStatus::no_target : FrameStatus::ok;
    for (std::size_t i = 0; i < searches.size(); ++i) searches[i].note_capacities(&result.capacities[3 * i]);
    for (const CapacityUse& use : result.capacities) {
      if (use.needed > use.capacity) result.status = FrameStatus::overflow;
    }
    if (config.digests) take_digests();
    return result;
  }

  void decode(const SearchResult& search) {
    const MarkerGeometry& g = plan.geometry();
    const View2D<const u8> image{frame(), g.width, g.height, g.padded_width};
    QuadCandidate candidate;
    Detection detection;
    for (int i = 0; i < search.slots(); ++i) {
      bool has_corners = false;
      if (!search.quad(i, candidate, has_corners)) continue;
      ++result.quads;
      if (!has_corners || is_cut_off(candidate, g.width, g.height) || is_known(candidate)) continue;
      if (decoder.decode(image, candidate, detection)) {
        result.detections.push_back(detection);
      } else {
        refused.push_back(candidate.fine);
      }
    }
  }

  void refine_corners() {
    const MarkerGeometry& g = plan.geometry();
    const View2D<const u8> image{frame(), g.width, g.height, g.padded_width};
    for (Detection& d : result.detections) {
      if (!fit->refine(image, *d.family, d.id, d.corners, d.corner_fit.emplace())) {
        d.corner_fit.reset();
        continue;
      }
      find_center(d);
    }
  }

  /// The edges' corners are where straight lines meet; the lens bends the marker's sides.
  void straighten() {
    for (Detection& d : result.detections) {
      straighten_corners(*config.camera, d.corners);
      find_center(d);
    }
  }

  static void find_center(Detection& d) {
    QuadMap map;
    if (map.set({d.corners[0], d.corners[3], d.corners[2], d.corners[1]}, 1, 0)) {
      map.at(0.5, 0.5, d.center[0], d.center[1]);
    }
  }

  void add_pose(Detection& d) const {
    const CameraModel& camera = *config.camera;
    const double size_m = marker_size_m(config, *d.family, d.id);
    d.pose_uncertainty.reset();
    d.has_pose = false;
    if (!(size_m > 0)) return;
    if (config.pose_method == PoseMethod::paper) {
      d.has_pose = paper_p4p(camera, size_m, d.corners, d.pose);
      return;
    }
    d.has_pose = marker_pose(camera, size_m, d.corners, corner_covariances(d, config.corner_deviation_px), d.pose,
                             d.pose_uncertainty.emplace());
    if (!d.has_pose) d.pose_uncertainty.reset();
  }

  /// Whether these corners have been decoded or refused already: most quadrilaterals are found by several searches.
  bool is_known(const QuadCandidate& candidate) const {
    for (const Detection& known : result.detections) {
      const double side = std::sqrt(square_distance(known.corners[0], known.corners[1]));
      if (same_corners(candidate.fine, known.corners, std::max(1.0, side / 10))) return true;
    }
    for (const Corners& known : refused) {
      if (same_corners(candidate.fine, known, 0.25)) return true;
    }
    return false;
  }

  void take_digests() {
    StageReader reader(plan, *stream);
    for (std::size_t i = 0; i < plan.stages().size(); ++i) {
      const std::vector<u32>& words = reader.read(i);
      result.digests.push_back({plan.stages()[i].name, digest_words(words.data(), words.size())});
    }
  }

  DetectorConfig config;
  std::vector<const MarkerFamily*> families;
  Decoder decoder;
  std::vector<BundlePoser> bundles;
  MarkerPlan plan;
  std::unique_ptr<Stream> stream;
  std::optional<PhotometricFit> fit;
  bool is_bending = false;  // straight lines in the world are not straight in the image
  std::vector<u8> staging;  // empty where the host reaches the device's memory
  std::vector<SearchResult> searches;
  std::vector<Corners> refused;  // candidates of the frame that hold no marker
  FrameResult result;
  Clock::time_point started;
};

double marker_size_m(const DetectorConfig& config, const MarkerFamily& family, int id) {
  for (const Bundle& bundle : config.bundles) {
    if (const BundleMarker* marker = bundle.find(family, id)) return marker->size_m;
  }
  return config.marker_size_m;
}

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

std::optional<StageDifference> first_difference(Detector& first, Detector& second) {
  StageReader a(first.impl_->plan, *first.impl_->stream);
  StageReader b(second.impl_->plan, *second.impl_->stream);
  return first_difference(a, b);
}

}  // namespace berth
