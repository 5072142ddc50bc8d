#pragma once

#include <map>
#include <memory>
#include <string>

#include "berth/backend.hpp"
#include "berth/image.hpp"
#include "berth/navigator.hpp"
#include "engine.hpp"

namespace berth::cli {

/// What the command line says about where the network runs.
struct NavigationOptions {
  /// A backend, or empty: the docking's, or what `record` says.
  std::string backend;
  /// Frames until its word counts; 0 for what was measured.
  int frames = 0;
  /// A file: read where it is there, else measured and written.
  std::string record;
};

/// Where the network runs, and when its word counts.
struct NavigationChoice {
  std::string backend;
  /// Its slowest look, ms, by backend: what was measured, or the record says; empty where nothing was.
  std::map<std::string, double> look_ms;
  int frames = 0;
  bool is_measured = false;
};

/// Measures what is asked for and not on record: looks over the whole of `image`, on the docking's backend and, where a
/// record is to be written, on every other that opens, but for those that are `simd` only slower. A look may take half
/// of the frames until its word counts, since the marker's part works beside it. Throws Error on a record that does not
/// fit, on a backend that does not open, and where nothing can be written.
NavigationChoice choose_navigation(const NavigationOptions& options, const EngineOptions& engine,
                                   const std::string& docking, const NavigatorConfig& navigator, View2D<const u8> image,
                                   double fps);

/// The backend by its name, with the engine's threads.
std::unique_ptr<Backend> open_for_navigation(const std::string& name, const EngineOptions& engine);

}  // namespace berth::cli
