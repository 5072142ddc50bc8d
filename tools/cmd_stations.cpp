// berth stations: the robot's camera and the dock's at once, and the one pose that both say.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "berth/error.hpp"
#include "camera/sources.hpp"
#include "commands.hpp"
#include "frame_json.hpp"
#include "interrupt.hpp"
#include "line_prefix.hpp"
#include "live_view.hpp"
#include "mount.hpp"
#include "run_config.hpp"
#include "station_run.hpp"
#include "stream.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth stations scenarios/stations.toml
  berth stations scenarios/stations.toml --json poses.jsonl
  berth stations cameras.toml --largest-difference-ms 2 --json - | jq .pose.t

FILE has the options below without their dashes, then [robot] and [dock], each with the keys of berth run
--config and marker, camera-at and marker-at (docs/stations.md). Ctrl-C ends both stations cleanly.)";
constexpr const char* kHelp = "docs/stations.md";
const std::vector<std::string> kSections = {"robot", "dock"};

struct Options {
  std::string file, log;
  double largest_difference_ms = 1;
  double wait_ms = 100;
  double gate = 28;
};

void add_options(CLI::App& command, Options& options) {
  command.add_option("--json", options.log, "log: one JSON line a moment; - for standard output")->type_name("FILE");
  command
      .add_option("--largest-difference-ms", options.largest_difference_ms,
                  "mid-exposures further apart are not of one moment; at most half of the shorter period")
      ->type_name("MS")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command
      .add_option("--wait-ms", options.wait_ms,
                  "so long a camera's frame waits for the other station's, then it goes alone")
      ->type_name("MS")
      ->check(CLI::Range(1.0, 10000.0))
      ->capture_default_str();
  command.add_option("--gate", options.gate, "the stations disagree above this chi-square of 6 degrees of freedom")
      ->type_name("X")
      ->check(CLI::Range(0.0, 1e9))
      ->capture_default_str();
}

/// One station: a `berth run` of its own, whose frames also go to the other's.
class StationCommand {
 public:
  StationCommand(StationSide side, const Options& options, Console& console, std::ostream& people, std::mutex& mutex,
                 StationRun& run)
      : side_(side),
        run_(run),
        out_text_(fmt::format("{:<6} ", name_of(side)), people, mutex),
        err_text_("", console.err(), mutex),
        out_(&out_text_),
        err_(&err_text_),
        console_(out_, err_, false),
        app_("", "berth") {
    app_.require_subcommand(1);
    add_run(app_, console_, exit_code_, [this](StreamOptions& stream) { join(stream); });
    CLI::App& command = *app_.get_subcommand("run");
    command.add_option("--marker", marker_)->required();
    command.add_option("--camera-at", camera_at_)->required();
    command.add_option("--marker-at", marker_at_)->required();
    arguments_ = section_arguments(options.file, command, name_of(side), {}, kHelp);
    arguments_.insert(arguments_.begin(), "run");
    std::reverse(arguments_.begin(), arguments_.end());  // as CLI11 wants them
  }

  void start() {
    thread_ = std::thread([this] {
      try {
        app_.parse(arguments_);
      } catch (const CLI::ParseError& error) {
        complain(error.what());
      } catch (const Error& error) {
        complain(error.what());
      } catch (const std::exception& error) {
        complain(std::string("unexpected: ") + error.what());
      }
      out_.flush();
      run_.leave(side_);
    });
  }
  void finish() {
    if (thread_.joinable()) thread_.join();
  }
  bool complained() const { return console_.complained(); }
  int exit_code() const { return exit_code_; }

 private:
  void complain(const std::string& what) { console_.complain(fmt::format("[{}] {}", name_of(side_), what)); }

  [[noreturn]] static void refuse(const std::string& key, const std::string& value, const std::string& remedy) {
    throw Error(fmt::format("key '{}' is '{}'; {}", key, value, remedy));
  }

  static Mount mount(const std::string& key, const std::string& text) {
    const std::optional<Mount> mount = read_mount(text);
    if (!mount) refuse(key, text, "give X,Y,Z,ROLL,PITCH,YAW in metres and degrees, e.g. 0.2,0,0.3,0,0,0");
    return *mount;
  }

  void join(StreamOptions& stream) {
    StationTarget target;
    const std::size_t colon = marker_.rfind(':');
    const std::string number = colon == std::string::npos ? "" : marker_.substr(colon + 1);
    const bool is_number = !number.empty() && number.size() < 7 &&
                           std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; });
    if (!is_number) refuse("marker", marker_, "give FAMILY:ID, e.g. tag36h11:7");
    target.family = marker_.substr(0, colon);
    target.id = std::stoi(number);
    if (const std::size_t ids = family(target.family).codes.size(); static_cast<std::size_t>(target.id) >= ids) {
      refuse("marker", marker_, fmt::format("its ids are 0 to {}", ids - 1));
    }
    const auto source = app_.get_subcommand("run")->get_option("--source")->as<std::string>();
    target.is_live = names_camera(source) || stream.pace.fps != 0;
    target.camera = mounted_camera(mount("camera-at", camera_at_));
    target.marker = mounted_marker(mount("marker-at", marker_at_));
    if (stream.log == "-") throw Error("key 'json' is '-'; both stations would write there: name a file");
    if (stream.engine.pose != "least-squares") {
      refuse("pose", stream.engine.pose, "leave it out: least squares say how exact a pose is");
    }
    if (stream.engine.size.empty() && stream.engine.bundle_files.empty()) {
      throw Error("key 'size' is missing; give the marker's side in metres, e.g. size = 0.08");
    }
    std::vector<std::string>& families = stream.engine.families;
    if (families.empty()) families.push_back(target.family);
    if (std::find(families.begin(), families.end(), target.family) == families.end()) {
      refuse("marker", marker_, "key 'family' leaves its family out; add it there");
    }
    stream.observers.push_back(run_.observer(side_, target));
  }

  const StationSide side_;
  StationRun& run_;
  LinePrefix out_text_, err_text_;
  std::ostream out_, err_;
  Console console_;
  CLI::App app_;
  int exit_code_ = kOk;
  std::string marker_, camera_at_, marker_at_;
  std::vector<std::string> arguments_;
  std::thread thread_;
};

const char* who_says(const FusedPose& fused) {
  return !fused.has_pose ? "none" : fused.used[0] && fused.used[1] ? "both" : fused.used[0] ? "robot" : "dock";
}

Json to_json(const StationMoment& moment, const FusedPose& fused) {
  Json line;
  line["time_ns"] = fused.time_ns;
  line["by"] = who_says(fused);
  for (std::size_t side = 0; side < kStationSides; ++side) {
    if (!moment.came[side]) continue;
    const StationFrame& frame = moment.frames[side];
    line[name_of(static_cast<StationSide>(side))] = {
        {"sequence", frame.stamp.sequence}, {"mid_exposure_ns", frame.stamp.mid_exposure_ns}, {"sees", frame.sees}};
  }
  if (moment.came[0] && moment.came[1]) line["difference_ns"] = moment.difference_ns;
  if (fused.has_pose) {
    const RelativePose& robot = fused.robot;
    line["pose"] = {{"R", robot.pose.R},
                    {"t", robot.pose.t},
                    {"covariance", robot.uncertainty.covariance},
                    {"error_px", robot.uncertainty.error_px},
                    {"ambiguity", robot.uncertainty.ambiguity()}};
    if (robot.views == 2) {
      line["disagreement"] = robot.disagreement;
      line["apart"] = robot.difference;
    }
  }
  if (fused.disagree) line["disagree"] = true;
  return line;
}

/// What the moments came to, and the lines that a person reads meanwhile.
class Moments {
 public:
  explicit Moments(std::ostream& people) : people_(people), view_(people, false, std::nullopt) {}

  void add(const StationMoment& moment, const FusedPose& fused) {
    ++moments_;
    const bool both = fused.used[0] && fused.used[1];
    by_both_ += both ? 1 : 0;
    by_robot_ += fused.used[0] && !both ? 1 : 0;
    by_dock_ += fused.used[1] && !both ? 1 : 0;
    disagreed_ += fused.disagree ? 1 : 0;
    if (moment.came[0] && moment.came[1]) {
      largest_difference_ns_ = std::max(largest_difference_ns_, std::abs(moment.difference_ns));
    }
    const std::string blind = moment.came[0] && moment.came[1] ? "blind" : "blind or without a frame";
    std::string who = "no pose: both stations " + blind;
    if (both) {
      who = fmt::format("by both, disagreement {:.1f}{}", fused.robot.disagreement,
                        fused.disagree ? ": THEY DISAGREE" : "");
    } else if (fused.disagree) {
      who = "no pose: THEY DISAGREE, no pose fits both";
    } else if (fused.has_pose) {
      who = fused.used[0] ? "by the robot's camera alone, the dock's is " + blind
                          : "by the dock's camera alone, the robot's is " + blind;
    }
    std::string place;
    if (fused.has_pose) {
      const std::array<double, 3>& t = fused.robot.pose.t;
      const std::array<double, 36>& c = fused.robot.uncertainty.covariance;
      place = fmt::format("robot at {:+.4f} {:+.4f} {:+.4f} m +- {:.2f} mm {:.2f} deg", t[0], t[1], t[2],
                          std::sqrt(c[0] + c[7] + c[14]) * 1e3,
                          std::sqrt(c[21] + c[28] + c[35]) * 180 / 3.14159265358979323846);
    }
    view_.show(moments_, place, {}, who);
  }

  void sum_up(StationRun& run) {
    people_ << fmt::format(
        "{} moment{}: {} by both, {} by the robot's camera alone, {} by the dock's alone, {} without "
        "a pose; the stations disagreed in {}\n",
        moments_, moments_ == 1 ? "" : "s", by_both_, by_robot_, by_dock_, moments_ - by_both_ - by_robot_ - by_dock_,
        disagreed_);
    people_ << fmt::format("largest difference of paired mid-exposures {:.3f} ms\n", ms_of(largest_difference_ns_));
    for (const StationSide side : {StationSide::robot, StationSide::dock}) {
      const StationCounts counts = run.counts(side);
      people_ << fmt::format("{}: {} frames paired, {} alone", name_of(side), counts.paired, counts.alone);
      if (counts.out_of_order > 0) people_ << fmt::format(", {} kept out, out of order", counts.out_of_order);
      if (counts.dropped > 0) people_ << fmt::format(", {} dropped", counts.dropped);
      people_ << '\n';
    }
  }

 private:
  std::ostream& people_;
  LiveView view_;
  u64 moments_ = 0, by_both_ = 0, by_robot_ = 0, by_dock_ = 0, disagreed_ = 0;
  std::int64_t largest_difference_ns_ = 0;
};

/// Ends both streams, however it comes to its own end.
struct BothStations {
  StationCommand &robot, &dock;
  StationRun& run;

  ~BothStations() {
    run.stop();
    InterruptWatch::ask();
    robot.finish();
    dock.finish();
  }
};

int run_stations(const Options& options, Console& console) {
  const InterruptWatch interrupt;
  std::ofstream log;
  if (!options.log.empty() && options.log != "-") {
    log.open(options.log, std::ios::binary);
    if (!log) throw Error(options.log + ": the log cannot be written; check the folder and its permissions");
  }
  std::ostream& lines = options.log == "-" ? console.out() : log;
  StationPairingConfig config;
  config.largest_difference_ns = std::llround(options.largest_difference_ms * 1e6);
  StationRun run(config, std::llround(options.wait_ms * 1e6));
  std::mutex mutex;
  std::ostream& people = options.log == "-" ? console.err() : console.out();
  StationCommand robot(StationSide::robot, options, console, people, mutex, run);
  StationCommand dock(StationSide::dock, options, console, people, mutex, run);
  LinePrefix both_text(fmt::format("{:<6} ", "both"), people, mutex);
  std::ostream both(&both_text);
  Moments moments(both);
  {
    const BothStations stations = {robot, dock, run};
    robot.start();
    dock.start();
    StationMoment moment;
    while (run.next(moment)) {
      const FusedPose fused = fuse(run.stations(), moment, options.gate);
      moments.add(moment, fused);
      if (!options.log.empty()) lines << to_line(to_json(moment, fused)) << '\n';
    }
  }
  moments.sum_up(run);
  if (log.is_open()) {
    log.close();
    if (!log) throw Error(options.log + ": writing the log failed; check the disk's space");
    both << "log         " << options.log << '\n';
  }
  if (robot.complained() || dock.complained()) return kBadInput;
  return std::max(robot.exit_code(), dock.exit_code());
}

}  // namespace

void add_stations(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("stations", "Two cameras at once, the robot's and the dock's, and one pose from both");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file, "TOML file of both stations")->type_name("")->required();
  add_options(*command, *options);
  command->footer(kExamples);
  command->callback([command, options, &console, &exit_code] {
    // What the file says beside the stations, where the command line does not.
    CLI::App of_file;
    add_options(of_file, *options);
    std::vector<std::string> arguments = section_arguments(options->file, *command, "", kSections, kHelp);
    std::reverse(arguments.begin(), arguments.end());
    of_file.parse(std::move(arguments));
    exit_code = run_stations(*options, console);
  });
}

}  // namespace berth::cli
