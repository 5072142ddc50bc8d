#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/detector.hpp"

namespace berth::cli {

/// What the command line says about the engine; empty where it says nothing.
struct EngineOptions {
  std::vector<std::string> families;
  std::string camera_file;
  std::string size;
  std::string backend;
  std::string device;
  int threads = 1;
  int max_hamming = 2;
};

/// --backend, --device, --threads
void add_backend_options(CLI::App& command, EngineOptions& options);
/// The above and --family, --camera, --size, --max-hamming
void add_engine_options(CLI::App& command, EngineOptions& options);

/// The backend asked for, or the first of backend_names() that opens. Throws Error.
std::unique_ptr<Backend> open_chosen_backend(const EngineOptions& options);

/// Checks every value; throws Error that names the field, its value and the remedy.
DetectorConfig make_config(const EngineOptions& options);

/// A marker side in metres as typed. Throws Error unless it is a finite number above 0 and at most 1000.
double parse_size(const std::string& text);

/// One frame's result and what it took.
struct TimedResult {
  const FrameResult& frame;
  /// Processor time of the whole process during submit and collect, ns.
  std::int64_t cpu_ns;
  /// The same by the wall clock, ns.
  std::int64_t wall_ns;
};

/// Detectors for frames of any size, made when a size first comes. A camera of another size gives no pose.
class Engine {
 public:
  Engine(std::unique_ptr<Backend> backend, DetectorConfig config);

  /// Detects; the result is valid until the next call. The detector of a size is warmed up by one detection outside the
  /// timing (first touch of its memory, kernels loaded).
  TimedResult detect(View2D<const u8> image, const FrameStamp& stamp);

  /// Why a frame of this size can have no pose although a camera was given; empty when all is well.
  std::string pose_refusal(int width, int height) const;

  const DetectorConfig& config() const { return config_; }
  Backend& backend() { return *backend_; }

 private:
  struct Sized {
    int width;
    int height;
    Detector detector;
  };
  Detector& detector_for(View2D<const u8> image, const FrameStamp& stamp);

  std::unique_ptr<Backend> backend_;
  DetectorConfig config_;
  /// Most recently used first.
  std::vector<Sized> detectors_;
};

}  // namespace berth::cli
