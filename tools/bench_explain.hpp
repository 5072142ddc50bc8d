#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bench_frames.hpp"
#include "bench_tables.hpp"
#include "work/measure.hpp"

namespace berth::cli {

/// The names of --modes.
const std::vector<std::string>& bench_mode_names();

/// A mode counted on one frame, and how to run it on a backend. What it refers to lives in ExplainedModes.
struct ExplainedMode {
  std::string name;
  std::string describes;
  work::FrameLoad load;
  std::function<std::unique_ptr<work::ModeFrame>(Backend&)> on;
  /// Too long to be timed on every backend; counted and projected only.
  bool counted_only = false;
};
class ExplainedModes {
 public:
  ExplainedModes(const std::vector<std::string>& names, const BenchFrame& frame);
  const std::vector<ExplainedMode>& modes() const { return modes_; }

 private:
  void add(const std::string& name, const BenchFrame& frame);

  Network lite_, paper_;
  std::vector<ExplainedMode> modes_;
};

/// A mode as measured on a backend of this machine, and as its description predicts it, µs.
struct MeasuredMode {
  std::vector<double> steps;
  double frame = 0;
  work::FrameTime predicted;
};
struct MeasuredBackend {
  std::string backend, device;
  work::Machine machine;
  double upload_us = 0;             // of the calibrating frame
  std::vector<MeasuredMode> modes;  // those not counted_only, in order
};
MeasuredBackend measure_backend(Backend& backend, const BenchFrame& calibration, const ExplainedModes& modes);

/// How far predictions were off: factors, of frames and of operations.
struct PredictionError {
  double worst_frame = 1, typical_frame = 1, typical_step = 1;
  int frames = 0;
};
PredictionError prediction_error(const std::vector<MeasuredBackend>& measured);

/// What was counted of each mode; per operation.
std::vector<BenchTable> count_tables(const ExplainedModes& modes);
/// What each backend took beside what was predicted, ns a pixel of the frame, and the shares of its rooflines.
std::vector<BenchTable> measured_tables(const ExplainedModes& modes, const std::vector<MeasuredBackend>& measured,
                                        std::size_t pixels);
/// Frames and operations on machines that are only described.
std::vector<BenchTable> projection_tables(const ExplainedModes& modes, const std::vector<work::Machine>& machines,
                                          const PredictionError& error);
/// The paper's Table 3, row by row.
BenchTable paper_table(const ExplainedModes& modes, const std::vector<MeasuredBackend>& measured,
                       const std::vector<BackendTimes>& frames, const std::vector<work::Machine>& machines);

Json to_json(const ExplainedMode& mode);
Json to_json(const MeasuredBackend& measured, const ExplainedModes& modes);
Json projection_json(const ExplainedModes& modes, const work::Machine& machine);

}  // namespace berth::cli
