#include "navigation_choice.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "berth/error.hpp"
#include "camera/bad_input.hpp"
#include "frame_json.hpp"
#include "output_file.hpp"

namespace berth::cli {
namespace {

constexpr int kLooks = 4;
/// Of the frames until a word counts, the share that a look may take.
constexpr double kShare = 0.5;

/// The slowest of several searches of the whole image, after one that is not counted; ms.
double slowest_look_ms(Backend& backend, const NavigatorConfig& config, View2D<const u8> image) {
  Navigator navigator(backend, image.width, image.height, config);
  double slowest = 0;
  for (int i = 0; i <= kLooks; ++i) {
    navigator.forget();
    const auto began = std::chrono::steady_clock::now();
    if (navigator.look(image).status == FrameStatus::device_lost) {
      throw Error(std::string(backend.name()) + " lost its device while the network was measured; see berth doctor");
    }
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    if (i > 0) slowest = std::max(slowest, took.count());
  }
  return slowest;
}

std::map<std::string, double> measure_all(const EngineOptions& engine, const NavigatorConfig& navigator,
                                          View2D<const u8> image) {
  std::map<std::string, double> all;
  for (const std::string& name : backend_names()) {
    if (name == "cpu" || name == "reference") continue;
    std::unique_ptr<Backend> backend;
    try {
      backend = open_for_navigation(name, engine);
    } catch (const Error&) {
      continue;  // not on this machine: berth doctor says why
    }
    all[name] = slowest_look_ms(*backend, navigator, image);
  }
  return all;
}

std::string size_of(View2D<const u8> image) { return std::to_string(image.width) + "x" + std::to_string(image.height); }

std::string file_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }

void write_record(const std::string& path, const NavigationChoice& choice, const std::string& network,
                  View2D<const u8> image) {
  const Json json = {{"backend", choice.backend},
                     {"network", file_name(network)},
                     {"size", size_of(image)},
                     {"slowest_look_ms", choice.look_ms}};
  write_file(path, "the record", json.dump(2) + "\n");
}

NavigationChoice read_record(const std::string& path, const std::string& network, View2D<const u8> image) {
  const std::string remedy = "; delete the file to have it measured again";
  std::ifstream file(path);
  const Json json = Json::parse(file, nullptr, false);
  const auto text = [&](const char* field, const std::string& wanted) {
    if (!json.is_object() || !json.contains(field) || !json[field].is_string()) {
      throw Error(path + ": field '" + field + "' is missing" + remedy);
    }
    const std::string found = json[field].get<std::string>();
    if (!wanted.empty() && found != wanted)
      throw bad_field(path, field, "'" + found + "'", "this is " + wanted + remedy);
    return found;
  };
  NavigationChoice choice;
  choice.backend = text("backend", "");
  text("network", file_name(network));
  text("size", size_of(image));
  const Json times = json.value("slowest_look_ms", Json::object());
  for (const auto& [name, ms] : times.items()) {
    if (ms.is_number() && ms.get<double>() > 0 && ms.get<double>() < 1e6) choice.look_ms[name] = ms.get<double>();
  }
  if (choice.look_ms.count(choice.backend) == 0) {
    throw Error(path + ": field 'slowest_look_ms' has no time above 0 for " + choice.backend + remedy);
  }
  return choice;
}

}  // namespace

std::unique_ptr<Backend> open_for_navigation(const std::string& name, const EngineOptions& engine) {
  EngineOptions options = engine;
  options.backend = name;
  if (name != engine.backend) options.device.clear();
  options.fallback = "none";
  options.lockstep.clear();
  return std::move(open_chosen_backends(options).backends.front());
}

NavigationChoice choose_navigation(const NavigationOptions& options, const EngineOptions& engine,
                                   const std::string& docking, const NavigatorConfig& navigator, View2D<const u8> image,
                                   double fps) {
  if (options.frames < 0 || options.frames > 10000) {
    throw bad_field("command line", "--nav-frames", std::to_string(options.frames), "give 1 or more, usually none");
  }
  NavigationChoice choice;
  if (!options.record.empty() && std::filesystem::exists(options.record)) {
    choice = read_record(options.record, navigator.network, image);
  } else if (!options.record.empty()) {
    choice.look_ms = measure_all(engine, navigator, image);
    const auto fastest = std::min_element(choice.look_ms.begin(), choice.look_ms.end(),
                                          [](const auto& a, const auto& b) { return a.second < b.second; });
    choice.backend = fastest->first;  // simd is always there
    choice.is_measured = true;
    write_record(options.record, choice, navigator.network, image);
  } else {
    choice.backend = options.backend.empty() ? docking : options.backend;
    if (options.frames == 0) {
      choice.look_ms[choice.backend] = slowest_look_ms(*open_for_navigation(choice.backend, engine), navigator, image);
      choice.is_measured = true;
    }
  }
  choice.frames =
      options.frames > 0
          ? options.frames
          : std::max(1, static_cast<int>(std::ceil(choice.look_ms.at(choice.backend) * fps / 1000 / kShare)));
  return choice;
}

}  // namespace berth::cli
