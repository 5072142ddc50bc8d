// berth survey: where several markers sit relative to each other, from images.
#include <CLI/CLI.hpp>
#include <memory>

#include "berth/error.hpp"
#include "commands.hpp"
#include "engine.hpp"
#if BERTH_WITH_SURVEY
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "camera/bad_input.hpp"
#include "camera/sources.hpp"
#include "interrupt.hpp"
#include "live_view.hpp"
#include "output_file.hpp"
#include "source_arguments.hpp"
#include "survey_show.hpp"
#endif

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth survey --camera camera.yaml --marker-size 0.05 --out bundle.yaml images/
  berth survey --camera camera.yaml --marker-size 0.03 --size 0=0.1 --origin 0 --out dock.yaml walk.mp4
  berth survey --marker-size 0.05 --size 4=0.04 --size 5=0.04 --out box.yaml scenarios/survey.toml

Every frame that shows two markers or more tells something; take them from all sides, 20 to 60 degrees apart.)";

struct SurveyCommand {
  std::vector<std::string> sources;
  std::string source;
  std::string size;
  std::vector<std::string> sizes;
  std::string out, plot, json;
  std::string name = "bundle";
  std::size_t most_frames = 300;
  int origin = -1;
  bool free_sizes = false;
  EngineOptions engine;
};

#if BERTH_WITH_SURVEY

SurveyOptions options_of(const SurveyCommand& command) {
  SurveyOptions options;
  options.size_m = parse_metres("--marker-size", command.size);
  for (const std::string& text : command.sizes) {
    const std::size_t equals = text.find('=');
    int id = -1;
    const char* end = text.data() + std::min(equals, text.size());
    const auto parsed = std::from_chars(text.data(), end, id);
    if (equals == std::string::npos || parsed.ec != std::errc() || parsed.ptr != end || id < 0) {
      throw bad_field("command line", "--size", "'" + text + "'", "give a marker's id and its side, e.g. 4=0.04");
    }
    options.sizes_m[id] = parse_metres("--size", text.substr(equals + 1));
  }
  if (command.origin >= 0) options.origin = command.origin;
  options.free_sizes = command.free_sizes;
  return options;
}

/// One name may be any source; several are images and folders.
std::unique_ptr<Source> source_of(const SurveyCommand& command) {
  if (command.source.empty() && command.sources.size() == 1) return open_source(command.sources[0]);
  return open_arguments(command.sources, command.source);
}

/// Looks for markers in every frame, with what has been seen as it grows.
class Gathering {
 public:
  Gathering(const SurveyCommand& command, double size_m, const std::optional<CameraModel>& own, Console& console)
      : console_(console) {
    DetectorConfig config = make_config(command.engine);
    if (!config.camera) config.camera = own;
    if (!config.camera) {
      throw bad_field("command line", "--camera", "missing", "give the camera's file; berth calibrate makes one");
    }
    config.marker_size_m = size_m;
    camera_ = *config.camera;
    frames_.emplace(camera_.width, command.most_frames);
    engine_.emplace(open_chosen_backends(command.engine), std::move(config));
  }

  const CameraModel& camera() const { return camera_; }

  const SurveyFrames& run(Source& source) {
    LiveView live(console_.out(), console_.out_is_terminal(), source.size());
    const InterruptWatch interrupt;
    std::size_t count = 0;
    while (const std::optional<SourceFrame> frame = next_readable(source, console_, interrupt)) {
      ++count;
      const char* verdict = look_at(*frame);
      live.show(count, fmt::format("{} frames taken, {} markers", frames_->frames().size(), seen_.size()), table(),
                fmt::format("{}: {}", frame->label, verdict));
    }
    live.finish();
    if (count == 0) throw Error("no image could be read; give images of the markers");
    console_.out() << fmt::format("{} frames: {} taken, {} with fewer than two markers, {} like another\n", count,
                                  frames_->frames().size(), frames_->alone(), frames_->repeated());
    return *frames_;
  }

 private:
  const char* look_at(const SourceFrame& frame) {
    const int width = frame.image.width(), height = frame.image.height();
    if (!engine_->camera_for(width, height)) {
      throw Error(
          fmt::format("{}: field 'size' is {}x{}, but the camera's image is {}x{}; give images as the camera "
                      "took them, or the camera's file for this size",
                      frame.label, width, height, camera_.width, camera_.height));
    }
    const TimedResult result = engine_->detect(frame.image.view(), frame.stamp);
    switch (frames_->add({frame.label, result.frame.detections})) {
      case SurveyFrames::Verdict::alone:
        return "fewer than two markers";
      case SurveyFrames::Verdict::repeated:
        return "like another";
      case SurveyFrames::Verdict::taken:
        break;
    }
    for (const Detection& marker : result.frame.detections)
      ++seen_[fmt::format("{} {}", marker.family->name, marker.id)];
    return "taken";
  }

  std::vector<std::string> table() const {
    std::vector<std::string> rows;
    for (const auto& [marker, frames] : seen_) rows.push_back(fmt::format("  {:<18} in {} frames", marker, frames));
    return rows;
  }

  Console& console_;
  CameraModel camera_;
  std::optional<SurveyFrames> frames_;
  std::optional<Engine> engine_;
  std::map<std::string, int> seen_;
};

int run_survey(const SurveyCommand& command, Console& console) {
  const SurveyOptions options = options_of(command);
  const std::unique_ptr<Source> source = source_of(command);
  Gathering gathering(command, options.size_m, source->camera(), console);
  const SurveyFrames& frames = gathering.run(*source);
  Survey result = survey(frames, gathering.camera(), options);
  result.bundle.name = command.name;
  for (const std::string& note : result.notes) console.note(note);
  if (!result.markers.empty()) {
    console.out() << survey_text(result);
    // What is wrong can be seen in them, so they are there all the same.
    if (!command.plot.empty()) write_file(command.plot, "the plot", layout_svg(result));
    if (!command.json.empty()) write_file(command.json, "the result", survey_json(result).dump(2) + "\n");
  }
  for (const std::string& objection : result.objections) console.note("refused: " + objection);
  if (!result.objections.empty()) return kNoResult;
  if (!command.out.empty()) {
    write_bundle(command.out, result.bundle);
    console.out() << command.out << ": " << result.bundle.markers.size() << " markers\n";
  }
  return kOk;
}

#else

int run_survey(const SurveyCommand& /*command*/, Console& /*console*/) {
  throw Error(
      "survey: this build has no Ceres; install libceres-dev, or Ceres Solver 2.0 or later, and build with "
      "-DBERTH_WITH_SURVEY=ON");
}

#endif

}  // namespace

void add_survey(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("survey", "Where several markers sit relative to each other, from images, as a bundle");
  const auto options = std::make_shared<SurveyCommand>();
  options->engine.corners = "photometric";  // here exactness counts, and time does not
  command->add_option("SOURCE", options->sources, "a scenario, video or folder, or image files: PNG, JPEG or PNM");
  command
      ->add_option("--source", options->source,
                   "sim:FILE, dir:DIR, video:FILE, mcap:FILE, v4l2:CAMERA, aravis:CAMERA or gst:PIPELINE instead")
      ->type_name("SOURCE");
  command->add_option("--camera", options->engine.camera_file, "camera file [that of the simulation]")
      ->type_name("FILE");
  command->add_option("--marker-size", options->size, "side of a marker's border square, metres")
      ->type_name("METRES")
      ->required();
  command->add_option("--size", options->sizes, "of single markers, e.g. 4=0.04; may be repeated")
      ->type_name("ID=METRES")
      ->allow_extra_args(false);
  command->add_option("--origin", options->origin, "the marker whose frame is the bundle's [the one seen most]")
      ->type_name("ID")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--free-sizes", options->free_sizes, "find out the sizes, too, but the origin's");
  command->add_option("-o,--out", options->out, "the bundle file to write, apriltag_ros' YAML")->type_name("FILE");
  command->add_option("--plot", options->plot, "drawing of the markers")->type_name("FILE.svg");
  command->add_option("--json", options->json, "the result with every deviation")->type_name("FILE");
  command->add_option("--name", options->name, "of the bundle in the file")->type_name("NAME")->capture_default_str();
  command->add_option("--frames", options->most_frames, "keep so many at most, those least alike")
      ->type_name("N")
      ->check(CLI::Range(5, 5000))
      ->capture_default_str();
  command->add_option("--family", options->engine.families, "marker family; may be repeated or a comma list [tag36h11]")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_corner_option(*command, options->engine);
  add_backend_options(*command, options->engine);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_survey(*options, console); });
}

}  // namespace berth::cli
