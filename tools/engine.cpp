#include "engine.hpp"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <locale>
#include <map>
#include <sstream>

#include "berth/error.hpp"
#include "camera/bad_input.hpp"

namespace berth::cli {
namespace {

constexpr const char* kCommandLine = "command line";

/// Detectors kept at a time: a folder of a few sizes warms each up once, and a folder of many does not fill the memory.
constexpr std::size_t kDetectorsKept = 4;

std::int64_t process_cpu_ns() {
  timespec now = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return std::int64_t{now.tv_sec} * 1000000000 + now.tv_nsec;
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

}  // namespace

void add_backend_options(CLI::App& command, EngineOptions& options) {
  command.add_option("--backend", options.backend, joined(backend_names()) + "; default: the first that opens")
      ->type_name("NAME");
  command.add_option("--device", options.device, "the backend's device, by index or by a part of its name")
      ->type_name("DEVICE");
  command.add_option("--threads", options.threads, "threads of the CPU backends, 0 for every core")
      ->type_name("N")
      ->capture_default_str();
}

void add_corner_option(CLI::App& command, EngineOptions& options) {
  command
      .add_option("--corners", options.corners,
                  "corners from the border's edges, or from a fit of the whole pattern: slower, as exact as the noise "
                  "allows")
      ->check(CLI::IsMember({"edges", "photometric"}))
      ->capture_default_str();
}

void add_engine_options(CLI::App& command, EngineOptions& options) {
  // allow_extra_args(false): "--family tag36h11 a.png" must not take a.png for a family.
  command
      .add_option("--family", options.families,
                  "marker family; may be repeated or a comma list; 'all' for every built-in one [tag36h11]")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option("--camera", options.camera_file,
                  "camera_info or Kalibr YAML, PhotonVision JSON; with --size, markers get a pose")
      ->type_name("FILE");
  command
      .add_option("--camera-fit", options.camera_fit,
                  "how images of another size came from the camera's: resize of the whole, or crop to the middle")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, CameraFit>{{"resize", CameraFit::resize}, {"crop", CameraFit::crop}}))
      ->type_name("HOW");
  command.add_option("--size", options.size, "side of the marker's border square, metres")->type_name("METRES");
  command
      .add_option(
          "--bundle", options.bundle_files,
          "markers that stand together, one pose for all: tag_bundles YAML, or a WPILib field layout in JSON whose "
          "markers are of --size; may be repeated")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command
      .add_option("--target", options.target_files,
                  "a target of discs or rings, looked for with --camera: a YAML file; may be repeated")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command.add_option("--pose", options.pose, "how poses are had: least-squares, or the paper's closed form")
      ->check(CLI::IsMember({"least-squares", "paper"}))
      ->capture_default_str();
  add_corner_option(command, options);
  command.add_option("--max-hamming", options.max_hamming, "most wrong bits a code may have")
      ->type_name("N")
      ->capture_default_str();
  add_backend_options(command, options);
}

void add_stream_backend_options(CLI::App& command, EngineOptions& options) {
  CLI::Option* lockstep = command
                              .add_option("--lockstep", options.lockstep,
                                          "two backends that both run every frame, bit against bit, e.g. simd,opencl "
                                          "(slow)")
                              ->type_name("A,B");
  command
      .add_option(
          "--fallback", options.fallback,
          "backend that runs the frame again when a device is lost, or none [simd, for a backend with a driver]")
      ->type_name("NAME")
      ->excludes(lockstep);
}

namespace {

BackendOptions backend_options(const EngineOptions& options) {
  if (options.threads < 0) {
    throw bad_field(kCommandLine, "--threads", std::to_string(options.threads), "give 0 for every core, or 1 or more");
  }
  BackendOptions backend_options;
  backend_options.device = options.device;
  backend_options.threads = options.threads;
  return backend_options;
}

std::unique_ptr<Backend> open_named(const char* field, const std::string& name, const BackendOptions& options) {
  const std::vector<std::string>& names = backend_names();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    throw bad_field(kCommandLine, field, "'" + name + "'",
                    "this build has no such backend, use one of " + joined(names));
  }
  return open_backend(name, options);
}

std::unique_ptr<Backend> open_first(const BackendOptions& options) {
  std::string reasons;
  for (const std::string& name : backend_names()) {
    try {
      return open_backend(name, options);
    } catch (const Error& error) {
      reasons += "\n  " + name + ": " + error.what();
    }
  }
  throw Error("no backend opens; see berth doctor" + reasons);
}

/// Buffers in the host's own memory: there is no device to lose.
bool runs_on_host(Backend& backend) { return backend.make_buffer(4)->host() != nullptr; }

}  // namespace

EngineBackends open_chosen_backends(const EngineOptions& options) {
  EngineBackends opened;
  const BackendOptions first_options = backend_options(options);
  BackendOptions second_options = first_options;
  second_options.device.clear();
  if (!options.lockstep.empty()) {
    const std::size_t comma = options.lockstep.find(',');
    if (comma == std::string::npos || !options.backend.empty()) {
      throw bad_field(kCommandLine, "--lockstep", "'" + options.lockstep + "'",
                      "give two backends, e.g. simd,opencl, and no --backend");
    }
    opened.lockstep = true;
    opened.backends.push_back(open_named("--lockstep", options.lockstep.substr(0, comma), first_options));
    opened.backends.push_back(open_named("--lockstep", options.lockstep.substr(comma + 1), second_options));
    return opened;
  }
  opened.backends.push_back(options.backend.empty() ? open_first(first_options)
                                                    : open_named("--backend", options.backend, first_options));
  const std::string fallback = options.fallback.empty() ? "simd" : options.fallback;
  if (fallback != "none" && (!options.fallback.empty() || !runs_on_host(*opened.backends.front()))) {
    opened.backends.push_back(open_named("--fallback", fallback, second_options));
  }
  std::vector<std::string> names;
  for (const auto& backend : opened.backends) names.emplace_back(backend->name());
  opened.reopen = [names, first_options, second_options](std::size_t i) {
    return open_backend(names[i], i == 0 ? first_options : second_options);
  };
  return opened;
}

double parse_metres(const char* option, const std::string& text, const std::string& remedy) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double metres = 0;
  stream >> metres;
  // The upper bound catches a size in millimetres before it becomes a pose a thousand times too far away.
  if (stream.fail() || !stream.eof() || !std::isfinite(metres) || !(metres > 0) || metres > 1000) {
    throw bad_field(kCommandLine, option, "'" + text + "'", remedy);
  }
  return metres;
}

double parse_size(const std::string& text) {
  return parse_metres(
      "--size", text,
      "give the side of the marker's border square in metres, above 0 and at most 1000, e.g. --size 0.08");
}

CornerMethod corner_method(const EngineOptions& options) {
  return options.corners == "photometric" ? CornerMethod::photometric : CornerMethod::edges;
}

namespace {

/// Reads the bundles, and has their families looked for: with none named, theirs alone.
void add_bundles(const EngineOptions& options, DetectorConfig& config) {
  if (options.bundle_files.empty()) return;
  if (options.families.empty()) config.families.clear();
  // A field layout names no family: the one that is asked for, if it is one.
  const std::string usual =
      options.families.size() == 1 && options.families[0] != "all" ? options.families[0] : DetectorConfig().families[0];
  for (const std::string& file : options.bundle_files) {
    for (Bundle& bundle : read_bundles(file, config.marker_size_m, usual)) config.bundles.push_back(std::move(bundle));
  }
  std::vector<std::string>& families = config.families;
  for (const Bundle& bundle : config.bundles) {
    for (const BundleMarker& marker : bundle.markers) {
      const std::string& name = marker.family->name;
      if (std::find(families.begin(), families.end(), name) == families.end()) families.push_back(name);
    }
  }
}

}  // namespace

DetectorConfig make_config(const EngineOptions& options) {
  DetectorConfig config;
  if (!options.families.empty()) config.families = options.families;
  if (config.families == std::vector<std::string>{"all"}) config.families = family_names();
  for (const std::string& name : config.families) {
    try {
      family(name);
    } catch (const Error& error) {
      throw bad_field(kCommandLine, "--family", "'" + name + "'", error.what());
    }
  }
  if (options.max_hamming < 0 || options.max_hamming > 16) {
    throw bad_field(kCommandLine, "--max-hamming", std::to_string(options.max_hamming), "give 0…16, usually 2");
  }
  config.max_hamming = options.max_hamming;
  if (!options.size.empty()) config.marker_size_m = parse_size(options.size);
  add_bundles(options, config);
  for (const std::string& file : options.target_files) config.disc_targets.push_back(read_disc_target(file));
  if (options.pose == "paper") config.pose_method = PoseMethod::paper;
  config.corner_method = corner_method(options);
  if (!options.camera_file.empty()) config.camera = read_camera(options.camera_file);
  return config;
}

bool wants_poses(const DetectorConfig& config) {
  return config.marker_size_m > 0 || !config.bundles.empty() || !config.disc_targets.empty();
}

Engine::Engine(EngineBackends backends, DetectorConfig config, CameraFit fit,
               const std::optional<TrackerConfig>& tracking, const std::optional<HealthConfig>& health)
    : backends_(std::move(backends)), config_(std::move(config)), fit_(fit), tracking_(tracking), health_(health) {}

std::string Engine::describe() const {
  const auto named = [](Backend& backend) { return std::string(backend.name()) + " on " + backend.device().name; };
  std::string text = named(*backends_.backends[active_]);
  if (backends_.lockstep) text += " in lockstep with " + named(*backends_.backends[1]);
  return text;
}

std::string Engine::pose_refusal(int width, int height) const {
  if (!config_.camera || !wants_poses(config_) || camera_for(width, height)) return "";
  const auto size = [](int w, int h) { return std::to_string(w) + "x" + std::to_string(h); };
  return "field 'size' is " + size(width, height) + ", but the camera file's image is " +
         size(config_.camera->width, config_.camera->height) +
         (fit_ == CameraFit::none
              ? ": no pose; use images as the camera was calibrated, a camera file for this size, or say with "
                "--camera-fit how they came from it"
              : ", which --camera-fit cannot make of it: no pose; use images of the same shape to resize, or smaller "
                "by "
                "even numbers to crop");
}

std::optional<CameraModel> Engine::camera_for(int width, int height) const {
  if (!config_.camera || (config_.camera->width == width && config_.camera->height == height)) return config_.camera;
  if (fit_ == CameraFit::none) return std::nullopt;
  try {
    return fit_ == CameraFit::resize ? resized_camera(*config_.camera, width, height)
                                     : cropped_camera(*config_.camera, width, height);
  } catch (const Error&) {
    return std::nullopt;
  }
}

DetectorConfig Engine::config_for(int width, int height) const {
  DetectorConfig config = config_;
  config.camera = camera_for(width, height);
  if (!wants_poses(config)) config.camera.reset();
  if (!config.camera) {
    config.marker_size_m = 0;
    config.disc_targets.clear();
  }
  return config;
}

std::vector<Backend*> Engine::backends() const {
  std::vector<Backend*> chain;
  for (const auto& backend : backends_.backends) chain.push_back(backend.get());
  return chain;
}

HealthReport Engine::health() const {
  if (detectors_.empty() || !detectors_.front().alone) return {};
  HealthReport report = detectors_.front().alone->health();
  // A detector of another size may know of no failure.
  if (report.mode == HealthMode::nominal && detectors_.front().first > 0) {
    report.mode = HealthMode::fallback;
    report.reason = left_;
  }
  return report;
}

Engine::Sized& Engine::detector_for(View2D<const u8> image, const FrameStamp& stamp) {
  const auto known = std::find_if(detectors_.begin(), detectors_.end(), [&](const Sized& sized) {
    return sized.width == image.width && sized.height == image.height;
  });
  if (known != detectors_.end()) {
    if (known != detectors_.begin() && known->tracker) known->tracker->reset();
    std::rotate(detectors_.begin(), known, known + 1);
    return detectors_.front();
  }
  if (detectors_.size() == kDetectorsKept) detectors_.pop_back();
  DetectorConfig config = config_for(image.width, image.height);
  Sized sized{image.width, image.height, backends_.lockstep ? 0 : active_, nullptr, nullptr, nullptr};
  if (tracking_) {
    config.window_sides = tracking_window_sides(image.width, image.height, *tracking_);
    sized.tracker = std::make_unique<Tracker>(image.width, image.height, *tracking_);
  }
  const std::vector<Backend*> chain = backends();
  if (backends_.lockstep) {
    sized.pair = std::make_unique<Lockstep>(*chain[0], *chain[1], image.width, image.height, config);
  } else {
    const std::vector<Backend*> left(chain.begin() + static_cast<std::ptrdiff_t>(sized.first), chain.end());
    std::optional<HealthConfig> health = health_;
    if (health && health->recovery) {
      health->recovery->open = [open = health->recovery->open, first = sized.first](std::size_t i) {
        return open(first + i);
      };
    }
    sized.alone = std::make_unique<FailoverDetector>(left, image.width, image.height, config, health);
  }
  sized.detect(image, stamp);
  detectors_.insert(detectors_.begin(), std::move(sized));
  return detectors_.front();
}

TimedResult Engine::detect(View2D<const u8> image, const FrameStamp& stamp) {
  Sized& detector = detector_for(image, stamp);
  const auto wall_start = std::chrono::steady_clock::now();
  const std::int64_t cpu_start = process_cpu_ns();
  const TrackedFrame* const tracked = detector.tracker ? &detector.tracker->look(detector, image, stamp) : nullptr;
  const FrameResult& frame = tracked != nullptr ? *tracked->result : detector.detect(image, stamp);
  const std::int64_t cpu_ns = process_cpu_ns() - cpu_start;
  const auto wall = std::chrono::steady_clock::now() - wall_start;
  if (detector.alone) {
    const std::size_t active = detector.first + detector.alone->active();
    if (active > active_) left_ = detector.alone->health().reason;
    active_ = active;
  }
  return {frame, cpu_ns, std::chrono::duration_cast<std::chrono::nanoseconds>(wall).count(),
          detector.pair ? detector.pair->difference() : std::nullopt, tracked};
}

}  // namespace berth::cli
