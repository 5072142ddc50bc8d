#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "recording_file.hpp"
#include "verify/faulty_camera.hpp"

namespace berth::cli {

/// What happens to the backend of a soak's scenario.
enum class BackendFault {
  none,
  lost,     ///< its device is lost in the middle; another one carries on
  hung,     ///< nothing comes from it for longer than is waited for; another one carries on
  stalled,  ///< it is slow for a while, more than once; nobody leaves it
};

/// A marker of a scenario's body.
struct SoakMarker {
  int id = 0;
  double x_m = 0, y_m = 0;
};

/// One of a soak's scenarios: what is seen, by what it is searched, what goes wrong. All of it follows from the soak's
/// seed and the scenario's number, on every machine.
struct SoakScenario {
  u64 seed = 1, number = 0;
  int width = 0, height = 0;
  std::string lens, family;
  double size_m = 0;
  std::vector<SoakMarker> markers;
  /// Pictures that are rendered, and frames that are made of them.
  int pictures = 0;
  u64 frames = 0;
  double frames_per_second = 0;

  bool in_real_time = false;
  bool track = false, filter = false, bundle = false, digests = false, known_answers = false;
  std::string corners, pose;
  /// `second`: that every frame is compared with; with `lockstep` that it runs on, too.
  std::string backend, second;
  bool lockstep = false;
  BackendFault backend_fault = BackendFault::none;
  /// The frame of it.
  int backend_fault_frame = 0;
  /// A device that was left is opened anew and gone back to.
  bool fail_back = false;

  bool record = false;
  RecordPictures recorded = RecordPictures::raw;
  /// The disk is full after so many bytes; 0 for never.
  u64 disk_bytes = 0;
  /// Frames at which a thread is stopped for 100 ms.
  std::vector<u64> starved;
  FaultyFilmOptions film;

  /// The rest of what is seen, as docs/simulator.md has it, but for the camera's file of a fisheye.
  std::string toml;

  /// Whether another backend is to carry on.
  bool loses_backend() const { return backend_fault == BackendFault::lost || backend_fault == BackendFault::hung; }
  /// What it is, in a line.
  std::string describe() const;
};

/// Draws a scenario for the backends there are; "simd" and "cpu" are among them.
SoakScenario draw_scenario(u64 seed, u64 number, const std::vector<std::string>& backends);

/// Files of a scenario, in that folder: the bundle's and the fisheye's camera; what it is rendered from.
std::string write_scenario(const SoakScenario& scenario, const std::string& folder);
std::string write_bundle_of(const SoakScenario& scenario, const std::string& folder);

}  // namespace berth::cli
