#include "berth/detector.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

#include "berth/error.hpp"
#include "frame/corner_match.hpp"
#include "frame/detector_parts.hpp"
#include "frame/digest.hpp"
#include "frame/stages.hpp"
#include "frame/window.hpp"
#include "target/bent_sides.hpp"
#include "target/bundle_pose.hpp"
#include "target/decode.hpp"
#include "target/disc_finder.hpp"
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

/// Of what was searched in one of the frame's areas.
StageReader stage_reader(DeviceFrame& frame, std::size_t area) {
  SearchArea& searched = *frame.areas()[area];
  return {searched.plan, frame.stream(), searched.place.full_resolution_only};
}

}  // namespace

struct HostFinish::Impl {
  Impl(int width, int height, const DetectorConfig& user_config)
      : config(user_config),
        families(find_families(config.families)),
        decoder(families, config.max_hamming),
        bundles(bundle_posers(config.bundles, families)) {
    const bool has_sizes = !bundles.empty() || !config.disc_targets.empty();
    if (config.camera && !(config.marker_size_m > 0) && (!has_sizes || config.marker_size_m != 0)) {
      throw Error("marker size is " + std::to_string(config.marker_size_m) + " m; give the side that the corners span");
    }
    if (!(config.corner_deviation_px >= 0)) {
      throw Error("corner_deviation_px is " + std::to_string(config.corner_deviation_px) +
                  "; give px above 0, or 0 for what each marker's edges say");
    }
    if (!config.disc_targets.empty()) {
      if (!config.camera) throw Error("targets of discs are asked for without a camera; give the camera's calibration");
      discs.emplace(config.disc_targets, *config.camera);
    }
    is_bending = config.camera && (config.camera->lens != LensModel::radial_tangential ||
                                   config.camera->distortion != std::array<double, 8>{});
    if (config.corner_method == CornerMethod::photometric) fit.emplace(config.camera, width, height);
  }

  void reserve(const DeviceFrame& frame, FrameResult& result, std::size_t most) {
    result.detections.reserve(most);
    result.bundles.resize(bundles.size());
    result.disc_targets.resize(config.disc_targets.size());
    found.reserve(frame.most_in_area());
    refused = CornerIndex(frame.geometry().width, frame.geometry().height, frame.most_in_area());
  }

  void finish(DeviceFrame& frame, FrameResult& result) {
    const Clock::time_point on_host = Clock::now();
    clear(result);
    for (const SearchArea* area : frame.areas()) decode(frame, *area, result);
    if (frame.areas().size() > 1) resolve_duplicates(result.detections);
    if (is_bending) straighten(result);
    const Clock::time_point decoded = Clock::now();
    if (fit) refine_corners(frame, result);
    const Clock::time_point refined = Clock::now();
    if (config.camera) {
      for (Detection& detection : result.detections) add_pose(detection);
      for (std::size_t i = 0; i < bundles.size(); ++i) {
        bundles[i].find(*config.camera, result.detections, config.corner_deviation_px, result.bundles[i]);
      }
    }
    const Clock::time_point posed = Clock::now();
    if (discs) find_discs(frame, result);
    const Clock::time_point done = Clock::now();
    result.times = {StageTime{"device", frame.done_ns() - frame.submitted_ns()},
                    StageTime{"decode", ns_between(on_host, decoded)}, StageTime{"pose", ns_between(refined, posed)},
                    StageTime{fit ? "corners" : "", ns_between(decoded, refined)},
                    StageTime{discs ? "discs" : "", ns_between(posed, done)}};
    const bool has_discs = std::any_of(result.disc_targets.begin(), result.disc_targets.end(),
                                       [](const DiscPose& target) { return target.has_pose; });
    result.status = result.detections.empty() && !has_discs ? FrameStatus::no_target : FrameStatus::ok;
    for (const SearchArea* area : frame.areas()) {
      for (std::size_t i = 0; i < area->searched(); ++i) {
        area->searches[i].note_capacities(&result.capacities[3 * i]);
      }
    }
    for (const CapacityUse& use : result.capacities) {
      if (use.needed > use.capacity) result.status = FrameStatus::overflow;
    }
    if (config.digests) take_digests(frame, result);
  }

  static void clear(FrameResult& result) {
    result.detections.clear();
    std::fill(result.bundles.begin(), result.bundles.end(), BundlePose{});
    std::fill(result.disc_targets.begin(), result.disc_targets.end(), DiscPose{});
    result.digests.clear();
    result.times = {};
    result.quads = 0;
    result.capacities = {};
  }

  /// What the area shows, without what another would have shown otherwise: a window is judged as if it were alone.
  void decode(const DeviceFrame& frame, const SearchArea& area, FrameResult& result) {
    found.clear();
    refused.clear();
    for (std::size_t i = 0; i < area.searched(); ++i) decode(frame.submitted(), area, i, result);
    resolve_duplicates(found);
    for (const Detection& detection : found) {
      if (frame.is_whole(area) || is_frames_own(detection, area.place)) result.detections.push_back(detection);
    }
  }

  void decode(View2D<const u8> image, const SearchArea& area, std::size_t index, FrameResult& result) {
    const SearchResult& search = area.searches[index];
    QuadCandidate candidate;
    Detection detection;
    for (int i = 0; i < search.slots(); ++i) {
      bool has_corners = false;
      if (!search.quad(i, area.place.x, area.place.y, candidate, has_corners)) continue;
      ++result.quads;
      if (!has_corners || is_cut_off(candidate, image.width, image.height) || is_known(candidate)) continue;
      if (decoder.decode(image, candidate, detection)) {
        detection.search = static_cast<int>(index);
        if (config.corner_deviation_px > 0) {
          detection.corner_covariance_px2 = independent_corners(config.corner_deviation_px);
        }
        found.push_back(detection);
      } else {
        refused.add(candidate.fine);
      }
    }
  }

  void find_discs(DeviceFrame& frame, FrameResult& result) {
    discs->clear();
    for (const SearchResult& search : frame.areas().front()->searches) search.add_outlines(*discs);
    discs->find(frame.image(), result.disc_targets);
  }

  void refine_corners(const DeviceFrame& frame, FrameResult& result) {
    const View2D<const u8> image = frame.submitted();
    for (Detection& d : result.detections) {
      if (!fit->refine(image, *d.family, d.id, d.corners, *d.corner_covariance_px2, d.corner_fit.emplace())) {
        d.corner_fit.reset();
        continue;
      }
      find_center(d);
    }
  }

  /// The edges' corners are where straight lines meet; the lens bends the marker's sides.
  void straighten(FrameResult& result) const {
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
    d.has_pose = marker_pose(camera, size_m, d.corners, *d.corner_covariance_px2, d.pose, d.pose_uncertainty.emplace());
    if (!d.has_pose) d.pose_uncertainty.reset();
  }

  /// Whether these corners have been decoded or refused already: most quadrilaterals are found by several searches.
  bool is_known(const QuadCandidate& candidate) const {
    for (const Detection& known : found) {
      const double side = std::sqrt(square_distance(known.corners[0], known.corners[1]));
      if (same_corners(candidate.fine, known.corners, std::max(1.0, side / 10))) return true;
    }
    return refused.has(candidate.fine, 0.25);
  }

  static void take_digests(DeviceFrame& frame, FrameResult& result) {
    for (std::size_t k = 0; k < frame.areas().size(); ++k) {
      const MarkerPlan& plan = frame.areas()[k]->plan;
      const std::string prefix = frame.is_whole(*frame.areas()[k]) ? "" : "window" + std::to_string(k) + "_";
      StageReader reader = stage_reader(frame, k);
      for (std::size_t i = 0; i < reader.stages(); ++i) {
        const std::vector<u32>& words = reader.read(i);
        result.digests.push_back({prefix + plan.stages()[i].name, digest_words(words.data(), words.size())});
      }
    }
  }

  DetectorConfig config;
  std::vector<const MarkerFamily*> families;
  Decoder decoder;
  std::vector<BundlePoser> bundles;
  std::optional<PhotometricFit> fit;
  std::optional<DiscFinder> discs;
  bool is_bending = false;       // straight lines in the world are not straight in the image
  std::vector<Detection> found;  // in the area at hand
  CornerIndex refused;           // its candidates that hold no marker
};

HostFinish::HostFinish(int width, int height, const DetectorConfig& config)
    : impl_(std::make_unique<Impl>(width, height, config)) {}
HostFinish::~HostFinish() = default;
HostFinish::HostFinish(HostFinish&&) noexcept = default;
HostFinish& HostFinish::operator=(HostFinish&&) noexcept = default;

void HostFinish::reserve(const DeviceFrame& frame, FrameResult& result, std::size_t most) {
  impl_->reserve(frame, result, most);
}
void HostFinish::finish(DeviceFrame& frame, FrameResult& result) { impl_->finish(frame, result); }
void HostFinish::list_constants(std::vector<ConstantMemory>& to) const {
  to.push_back({"configuration", &impl_->config, sizeof impl_->config});
  for (const Bundle& bundle : impl_->config.bundles) add_constants("bundle", bundle.markers, to);
  for (const MarkerFamily* family : impl_->families) {
    add_constants("family", family->codes, to);
    add_constants("family", family->bit_x, to);
    add_constants("family", family->bit_y, to);
  }
  impl_->decoder.list_constants(to);
}
void HostFinish::give_up(FrameResult& result) {
  Impl::clear(result);
  result.status = FrameStatus::device_lost;
}

struct Detector::Impl {
  Impl(Backend& backend, int width, int height, const DetectorConfig& config, bool keeps_stages)
      : device(backend, width, height, config, keeps_stages), host(width, height, config) {
    host.reserve(device, result);
  }

  void submit(View2D<const u8> image, const FrameStamp& stamp, const std::vector<SearchWindow>& windows) {
    const MarkerGeometry& g = device.geometry();
    if (image.width != g.width || image.height != g.height) {
      throw Error("frame is " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                  "; this detector was made for " + std::to_string(g.width) + "x" + std::to_string(g.height));
    }
    result.stamp = stamp;
    if (!windows.empty()) {
      device.submit_windows(image, windows);
      return;
    }
    pad_frame(image, g, device.pixels());
    device.submit();
  }

  const FrameResult& collect() {
    if (device.finish()) {
      host.finish(device, result);
    } else {
      HostFinish::give_up(result);
    }
    return result;
  }

  DeviceFrame device;
  HostFinish host;
  FrameResult result;
};

double marker_size_m(const DetectorConfig& config, const MarkerFamily& family, int id) {
  for (const Bundle& bundle : config.bundles) {
    if (const BundleMarker* marker = bundle.find(family, id)) return marker->size_m;
  }
  return config.marker_size_m;
}

Detector::Detector(Backend& backend, int width, int height, const DetectorConfig& config)
    : Detector(backend, width, height, config, config.digests) {}
Detector::Detector(Backend& backend, int width, int height, const DetectorConfig& config, bool keeps_stages)
    : impl_(std::make_unique<Impl>(backend, width, height, config, keeps_stages)) {}
Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

void Detector::submit(View2D<const u8> image, const FrameStamp& stamp, const std::vector<SearchWindow>& windows) {
  impl_->submit(image, stamp, windows);
}
const FrameResult& Detector::collect() { return impl_->collect(); }
const FrameResult& Detector::detect(View2D<const u8> image, const FrameStamp& stamp,
                                    const std::vector<SearchWindow>& windows) {
  submit(image, stamp, windows);
  return collect();
}
std::size_t Detector::device_bytes() const { return impl_->device.device_bytes(); }

void Detector::list_constants(std::vector<ConstantMemory>& to) const {
  impl_->device.list_constants(to);
  impl_->host.list_constants(to);
}

std::optional<StageDifference> first_difference(Detector& first, Detector& second) {
  DeviceFrame& one = first.impl_->device;
  DeviceFrame& two = second.impl_->device;
  for (std::size_t i = 0; i < one.areas().size(); ++i) {
    StageReader a = stage_reader(one, i), b = stage_reader(two, i);
    if (auto difference = first_difference(a, b)) return difference;
  }
  return std::nullopt;
}

}  // namespace berth
