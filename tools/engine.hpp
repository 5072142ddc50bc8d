#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/failover.hpp"
#include "berth/lockstep.hpp"
#include "berth/tracker.hpp"

namespace berth::cli {

/// How images of another size than the camera's came from it.
enum class CameraFit { none, resize, crop };

/// What the command line says about the engine; empty where it says nothing.
struct EngineOptions {
  std::vector<std::string> families;
  std::string camera_file;
  CameraFit camera_fit = CameraFit::none;
  std::string size;
  /// One standard deviation of it, and of where edges are seen, px.
  std::string size_deviation;
  double edge_deviation = 0;
  /// Files of bundles.
  std::vector<std::string> bundle_files;
  /// Files of targets of discs.
  std::vector<std::string> target_files;
  std::string pose = "least-squares";
  std::string corners = "edges";
  std::string backend;
  std::string device;
  int threads = 1;
  int max_hamming = 2;
  /// The backend that takes over when the chosen one loses its device; "none", or empty for simd.
  std::string fallback;
  /// Two backends to run in lockstep, "A,B", in place of `backend`.
  std::string lockstep;
};

/// The opened backends of an engine: in order of fail-over, or the two that run in lockstep.
struct EngineBackends {
  std::vector<std::unique_ptr<Backend>> backends;
  bool lockstep = false;
  /// Opens one of them anew. Throws Error.
  std::function<std::unique_ptr<Backend>(std::size_t)> reopen;
};

/// --backend, --device, --threads
void add_backend_options(CLI::App& command, EngineOptions& options);
/// The above and --family, --camera, --size, --bundle, --target, --max-hamming
void add_engine_options(CLI::App& command, EngineOptions& options);

/// --corners
void add_corner_option(CLI::App& command, EngineOptions& options);
CornerMethod corner_method(const EngineOptions& options);

/// --lockstep and --fallback, for streams
void add_stream_backend_options(CLI::App& command, EngineOptions& options);

/// The backend asked for, or the first of backend_names() that opens, with its fall-back; or the pair. Throws Error.
EngineBackends open_chosen_backends(const EngineOptions& options);

/// Checks every value, reads the files named, and adds the bundles' families to those looked for; throws Error that
/// names the field, its value and the remedy.
DetectorConfig make_config(const EngineOptions& options);

/// Whether there is anything that a camera would give a pose: a size, a bundle or a target.
bool wants_poses(const DetectorConfig& config);

/// Metres as typed after `option`. Throws Error with that remedy unless it is a finite number above 0 and at most 1000.
double parse_metres(const char* option, const std::string& text,
                    const std::string& remedy = "give metres, above 0 and at most 1000, e.g. 0.05");
/// A marker side in metres as typed. Throws Error unless it is a finite number above 0 and at most 1000.
double parse_size(const std::string& text);

/// One frame's result and what it took.
struct TimedResult {
  const FrameResult& frame;
  /// Processor time of the whole process during submit and collect, ns.
  std::int64_t cpu_ns;
  /// The same by the wall clock, ns.
  std::int64_t wall_ns;
  /// What the two in lockstep differ in.
  std::optional<StageDifference> difference;
  /// How the frame was searched, where windows are; null otherwise.
  const TrackedFrame* tracked = nullptr;
};

/// Detectors for frames of any size, made when a size first comes. A camera of another size gives no pose, unless it is
/// said how it fits.
class Engine {
 public:
  /// `tracking`: markers are followed in windows, frame after frame. `health`: not for those in lockstep.
  Engine(EngineBackends backends, DetectorConfig config, CameraFit fit = CameraFit::none,
         const std::optional<TrackerConfig>& tracking = std::nullopt,
         const std::optional<HealthConfig>& health = std::nullopt);

  /// Detects; the result is valid until the next call. The detector of a size is warmed up by one detection outside the
  /// timing (first touch of its memory, kernels loaded).
  TimedResult detect(View2D<const u8> image, const FrameStamp& stamp);

  /// Why a frame of this size can have no pose although a camera was given; empty when all is well.
  std::string pose_refusal(int width, int height) const;
  /// The camera for frames of this size; none where none was given or it does not fit.
  std::optional<CameraModel> camera_for(int width, int height) const;

  /// What follows markers in the frames of the size that came last; null before the first, or where nothing does.
  Tracker* tracker() { return detectors_.empty() ? nullptr : detectors_.front().tracker.get(); }
  const DetectorConfig& config() const { return config_; }
  /// The same for frames of one size: without what they can have no pose of.
  DetectorConfig config_for(int width, int height) const;
  /// In order of fail-over.
  std::vector<Backend*> backends() const;
  /// Of the detector of the frames that came last.
  HealthReport health() const;
  bool is_lockstep() const { return backends_.lockstep; }
  /// The one whose results are given: it changes when a device is lost.
  Backend& backend() { return *backends_.backends[active_]; }
  /// "simd on NAME", and "in lockstep with" the other.
  std::string describe() const;

 private:
  struct Sized {
    int width;
    int height;
    /// The first of the backends that it was made for: those left before are lost.
    std::size_t first;
    /// One of the two.
    std::unique_ptr<FailoverDetector> alone;
    std::unique_ptr<Lockstep> pair;
    /// None where nothing is followed.
    std::unique_ptr<Tracker> tracker;

    const FrameResult& detect(View2D<const u8> image, const FrameStamp& stamp,
                              const std::vector<SearchWindow>& windows = {}) {
      return pair ? pair->detect(image, stamp, windows) : alone->detect(image, stamp, windows);
    }
  };
  Sized& detector_for(View2D<const u8> image, const FrameStamp& stamp);

  EngineBackends backends_;
  std::size_t active_ = 0;
  /// Why a backend was left; null where none was.
  const char* left_ = nullptr;
  DetectorConfig config_;
  CameraFit fit_;
  std::optional<TrackerConfig> tracking_;
  std::optional<HealthConfig> health_;
  /// Most recently used first.
  std::vector<Sized> detectors_;
};

}  // namespace berth::cli
