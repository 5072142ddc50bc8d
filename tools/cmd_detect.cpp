// berth detect: markers in image files.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <set>

#include "annotate.hpp"
#include "berth/error.hpp"
#include "bundle_show.hpp"
#include "camera/bad_input.hpp"
#include "camera/image_file.hpp"
#include "commands.hpp"
#include "engine.hpp"
#include "frame_json.hpp"
#include "systematic_show.hpp"
#include "target_show.hpp"

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  berth detect photo.jpg
  berth detect --json photos/ more/*.png > markers.jsonl
  berth detect --family tag36h11,aruco4x4_50 --draw seen.png photo.jpg
  berth detect --camera cam.yaml --size 0.08 --draw annotated/ photos/
  berth detect --camera cam.yaml --bundle dock.yaml photos/
  berth detect --camera cam.yaml --target targets/port.yaml photos/
  berth detect --camera cam.yaml --size 0.08 --size-deviation 0.0002 photos/   what calibration and size leave open

Corners start at the upper left of the upright marker and go counter-clockwise; pixel centres lie at integers.)";

struct DetectOptions {
  std::vector<std::string> images;
  EngineOptions engine;
  bool json = false;
  bool recursive = false;
  std::string draw;
};

/// Every image file named, folders expanded. A folder that cannot be listed is complained about and left out.
std::vector<std::string> expand(const DetectOptions& options, Console& console) {
  std::vector<std::string> paths;
  for (const std::string& image : options.images) {
    std::error_code ignored;
    if (!fs::is_directory(image, ignored)) {
      paths.push_back(image);
      continue;
    }
    try {
      for (std::string& path : list_images(image, options.recursive)) paths.push_back(std::move(path));
    } catch (const Error& error) {
      console.complain(error.what());
    }
  }
  return paths;
}

/// Where annotated pictures go: one file, or a folder with one PNG for each image.
class DrawTarget {
 public:
  DrawTarget(const std::string& out, std::size_t images) : out_(out) {
    if (out_.empty()) return;
    std::error_code error;
    const std::string ending = fs::path(out_).extension().string();
    is_file_ = (ending == ".png" || ending == ".PNG") && !fs::is_directory(out_, error);
    if (is_file_ && images > 1) {
      throw bad_field("command line", "--draw", "'" + out_ + "'",
                      "one file cannot hold " + std::to_string(images) + " pictures, name a folder");
    }
    if (is_file_) return;
    fs::create_directories(out_, error);
    if (error) {
      throw bad_field("command line", "--draw", "'" + out_ + "'",
                      "the folder cannot be made (" + error.message() + "), name another");
    }
  }

  bool wanted() const { return !out_.empty(); }

  /// The picture's file for an image: its name with .png, made unique within this run by a number.
  std::string path_for(const std::string& image) {
    if (is_file_) return out_;
    const std::string stem = fs::path(image).stem().string();
    std::string name = stem + ".png";
    for (int n = 2; !used_.insert(name).second; ++n) name = stem + "_" + std::to_string(n) + ".png";
    return (fs::path(out_) / name).string();
  }

 private:
  std::string out_;
  bool is_file_ = false;
  std::set<std::string> used_;
};

/// Of each detection, what is off in every frame alike.
using Systematic = std::vector<std::optional<std::array<double, 36>>>;

void print_table(Console& console, const std::string& image, const TimedResult& result, const DetectorConfig& config,
                 const Systematic& systematic) {
  const std::vector<Detection>& detections = result.frame.detections;
  console.out() << fmt::format("{}: {} marker{}, {:.3f} ms\n", image, detections.size(),
                               detections.size() == 1 ? "" : "s", ms_of(result.cpu_ns));
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const Detection& d = detections[i];
    console.out() << fmt::format("  {:<18} {:>4}  hamming {}  margin {:5.1f}  corner 1 ({:.2f}, {:.2f})",
                                 d.family->name, d.id, d.hamming, d.margin, d.corners[0][0], d.corners[0][1]);
    if (d.has_pose) {
      const std::array<double, 3>& t = d.pose.t;
      console.out() << fmt::format("  t ({:.4f}, {:.4f}, {:.4f}) m, range {:.4f} m", t[0], t[1], t[2],
                                   std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]));
    }
    if (systematic[i]) console.out() << range_deviations(d, *systematic[i]);
    console.out() << '\n';
  }
  for (std::size_t i = 0; i < config.bundles.size(); ++i) {
    console.out() << "  " << describe(config.bundles[i].name, result.frame.bundles[i]) << '\n';
  }
  for (std::size_t i = 0; i < result.frame.disc_targets.size(); ++i) {
    console.out() << "  " << describe(config.disc_targets[i], result.frame.disc_targets[i]) << '\n';
  }
}

void warn_of_overflow(Console& console, const std::string& image, const FrameResult& frame) {
  if (frame.status != FrameStatus::overflow) return;
  for (const CapacityUse& use : frame.capacities) {
    if (use.needed <= use.capacity) continue;
    console.note(image + ": field '" + use.what + "' is " + std::to_string(use.needed) + ", above the capacity of " +
                 std::to_string(use.capacity) + ": markers may be missing; use a cleaner or smaller image");
  }
}

void detect_one(const std::string& path, const DetectOptions& options, const SystematicErrors& errors, Engine& engine,
                DrawTarget& draw, Console& console) {
  const GrayImage image = read_gray_image(path);
  const TimedResult result = engine.detect(image.view(), {});
  if (result.frame.status == FrameStatus::device_lost) {
    throw Error(path + ": the device was lost during the frame; see berth doctor, or use --backend simd");
  }
  warn_of_overflow(console, path, result.frame);
  Systematic systematic;
  for (const Detection& d : result.frame.detections) {
    const double size_m = marker_size_m(engine.config(), *d.family, d.id);
    systematic.push_back(errors.of(engine, image.width(), image.height(), size_m, d));
  }
  if (options.json) {
    Json line = {{"image", path}, {"ms", ms_of(result.cpu_ns)}, {"detections", to_json(result.frame.detections)}};
    for (std::size_t i = 0; i < systematic.size(); ++i) add_systematic(systematic[i], line["detections"][i]);
    const std::vector<Bundle>& bundles = engine.config().bundles;
    if (!bundles.empty()) line["bundles"] = to_json(result.frame.bundles, bundles);
    const std::vector<DiscPose>& targets = result.frame.disc_targets;
    if (!targets.empty()) line["targets"] = to_json(targets, engine.config().disc_targets);
    console.out() << to_line(line) << '\n';
  } else {
    print_table(console, path, result, engine.config(), systematic);
  }
  const std::string refusal = engine.pose_refusal(image.width(), image.height());
  if (!refusal.empty()) console.complain(path + ": " + refusal + " (" + options.engine.camera_file + ")");
  if (draw.wanted()) {
    write_annotated(draw.path_for(path), image.view(), result.frame.detections,
                    engine.camera_for(image.width(), image.height()), engine.config().disc_targets,
                    result.frame.disc_targets);
  }
}

void run_detect(const DetectOptions& options, Console& console) {
  DetectorConfig config = make_config(options.engine);
  const bool has_sizes = wants_poses(config);
  if (options.engine.camera_file.empty() == has_sizes) {
    console.note(std::string("no poses: ") + (has_sizes ? "--camera" : "--size") + " is missing");
  }
  const std::vector<std::string> paths = expand(options, console);
  DrawTarget draw(options.draw, paths.size());
  const SystematicErrors errors(options.engine);
  Engine engine(open_chosen_backends(options.engine), std::move(config), options.engine.camera_fit);
  for (const std::string& path : paths) {
    try {
      detect_one(path, options, errors, engine, draw, console);
    } catch (const Error& error) {
      console.complain(error.what());
    } catch (const std::bad_alloc&) {
      console.complain(path + ": out of memory; use a smaller image");
    }
  }
}

}  // namespace

void add_detect(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("detect", "Find markers in image files");
  const auto options = std::make_shared<DetectOptions>();
  command->add_option("IMAGE", options->images, "PNG, JPEG or PNM files, or folders of them")->required();
  command->add_flag("--json", options->json, "one JSON line for each image on standard output, and nothing else there");
  command->add_flag("-r,--recursive", options->recursive, "folders with their subfolders");
  command->add_option("--draw", options->draw, "write annotated PNGs: a .png file for one image, or a folder")
      ->type_name("OUT");
  add_engine_options(*command, options->engine);
  add_deviation_options(*command, options->engine);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] {
    run_detect(*options, console);
    exit_code = kOk;
  });
}

}  // namespace berth::cli
