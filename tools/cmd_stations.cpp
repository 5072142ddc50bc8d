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
#include "moment_check.hpp"
#include "moment_lines.hpp"
#include "moment_publisher.hpp"
#include "moment_record.hpp"
#include "moment_recorder.hpp"
#include "mount.hpp"
#include "recording_setup.hpp"
#include "replay_check.hpp"
#include "run_config.hpp"
#include "run_options.hpp"
#include "station_run.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth stations scenarios/stations.toml
  berth stations scenarios/stations.toml --json poses.jsonl
  berth stations cameras.toml --largest-difference-ms 2 --json - | jq .pose.t
  berth stations cameras.toml --record both.mcap --ros      the pose of both recorded, and to ROS 2 nodes
  berth stations cameras.toml --record both.mcap --replay   again from the recordings, to the same bits

FILE has the options below without their dashes, then [robot] and [dock], each with the keys of berth run
--config and marker, camera-at and marker-at (docs/stations.md). Ctrl-C ends both stations cleanly.)";
constexpr const char* kHelp = "docs/stations.md";
const std::vector<std::string> kSections = {"robot", "dock"};

struct Options {
  std::string file, log, record;
  bool replay = false;
  std::string robot_frame = "base_link", dock_frame = "dock";
  double largest_difference_ms = 1;
  double wait_ms = 100;
  double gate = 28;
  RosOptions ros;

  Options() { ros.offered = {RosTopic::pose, RosTopic::dock_pose, RosTopic::tf, RosTopic::diagnostics}; }
};

void add_options(CLI::App& command, Options& options) {
  command.add_option("--json", options.log, "log: one JSON line a moment; - for standard output")->type_name("FILE");
  command
      .add_option("--record", options.record,
                  "record the pose of both and what --json says in an MCAP file (docs/recording.md)")
      ->type_name("FILE");
  command.add_flag("--replay", options.replay,
                   "the stations' frames and options from their own recordings, compared with these and with --record");
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
  command.add_option("--robot-frame", options.robot_frame, "what the robot's frame is called, recorded and published")
      ->type_name("NAME")
      ->capture_default_str();
  command.add_option("--dock-frame", options.dock_frame, "and the dock's")->type_name("NAME")->capture_default_str();
  add_ros_network_options(command, options.ros, "the pose of both, tf, diagnostics");
}

/// One station: a `berth run` of its own, whose frames also go to the other's.
class StationCommand {
 public:
  StationCommand(StationSide side, const Options& options, Console& console, std::ostream& people, std::mutex& mutex,
                 StationRun& run)
      : side_(side),
        options_(options),
        run_(run),
        out_text_(fmt::format("{:<6} ", name_of(side)), people, mutex),
        err_text_("", console.err(), mutex),
        out_(&out_text_),
        err_(&err_text_),
        console_(out_, err_, false),
        app_("", "berth") {
    app_.require_subcommand(1);
    add_run(app_, console_, exit_code_, [this](RunOptions& asked) { join(asked); });
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
  int exit_code() const {
    const bool is_replay_off = check_ && (check_->differing() > 0 || check_->not_compared() > 0);
    return is_replay_off ? kNoResult : exit_code_;
  }

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

  /// The station's frames as they were recorded, with the options of then, compared with what they came to.
  void replay(RunOptions& run) {
    const std::string file = run.record.file;
    if (file.empty()) throw Error("key 'record' is missing; --replay takes the station's frames from that recording");
    const EngineOptions given = run.stream.engine;
    run = RunOptions();
    run.source = "mcap:" + file;
    run.stream = restore_run(mcap::Reader(file), file, files_.emplace().path());
    if (!given.backend.empty()) run.stream.engine.backend = given.backend;
    run.stream.engine.device = given.device;
    run.stream.engine.threads = given.threads;
    check_ = std::make_shared<ReplayCheck>(file, run.stream.track || run.stream.filter);
    run.stream.observers.push_back(check_);
  }

  void join(RunOptions& run) {
    if (options_.replay) replay(run);
    if (!run.record.file.empty() && run.record.file == options_.record) {
      refuse("record", run.record.file, "the moments of both are recorded there; name another file");
    }
    StreamOptions& stream = run.stream;
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
    target.is_live = names_camera(run.source) || stream.pace.fps != 0;
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
  const Options& options_;
  StationRun& run_;
  LinePrefix out_text_, err_text_;
  std::ostream out_, err_;
  Console console_;
  CLI::App app_;
  int exit_code_ = kOk;
  std::string marker_, camera_at_, marker_at_;
  std::vector<std::string> arguments_;
  /// Of a replay.
  std::optional<RestoredFiles> files_;
  std::shared_ptr<ReplayCheck> check_;
  std::thread thread_;
};

/// One JSON line a moment.
class MomentLog final : public MomentObserver {
 public:
  /// `path`: "-" for `out`. Throws Error where it cannot be written.
  MomentLog(const std::string& path, std::ostream& out) : path_(path), lines_(path == "-" ? out : file_) {
    if (path == "-") return;
    file_.open(path, std::ios::binary);
    if (!file_) throw Error(path + ": the log cannot be written; check the folder and its permissions");
  }

  void observe(const ObservedMoment& observed) override {
    lines_ << to_line(moment_record(observed.moment, observed.fused)) << '\n';
  }

  void finish(const BothCounts&, std::ostream& people) override {
    if (!file_.is_open()) return;
    file_.close();
    if (!file_) throw Error(path_ + ": writing the log failed; check the disk's space");
    people << "log         " << path_ << '\n';
  }

 private:
  const std::string path_;
  std::ofstream file_;
  std::ostream& lines_;
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

MomentRecording recording_of(const Options& options, const VehicleFrames& frames) {
  MomentRecording recording{options.record, options.file, {}, frames, options.gate};
  recording.settings = {{"version", BERTH_VERSION},
                        {"largest-difference-ms", fmt::format("{}", options.largest_difference_ms)},
                        {"gate", fmt::format("{}", options.gate)},
                        {"robot-frame", frames.robot},
                        {"dock-frame", frames.dock}};
  return recording;
}

/// Whoever gets the moments; of a replay, `check` among them. `pair`: where what is said of both goes.
std::vector<std::unique_ptr<MomentObserver>> observers_of(const Options& options, std::ostream& out, Console& pair,
                                                          MomentCheck*& check) {
  const VehicleFrames frames = {checked_frame("--robot-frame", options.robot_frame),
                                checked_frame("--dock-frame", options.dock_frame)};
  std::vector<std::unique_ptr<MomentObserver>> observers;
  observers.push_back(std::make_unique<MomentLines>(pair.out()));
  if (options.replay) {
    if (options.record.empty()) {
      throw Error("--replay: key 'record' at the top is missing; the moments are compared with that recording");
    }
    auto replayed = std::make_unique<MomentCheck>(options.record);
    check = replayed.get();
    observers.push_back(std::move(replayed));
  } else {
    if (!options.record.empty()) {
      observers.push_back(std::make_unique<MomentRecorder>(recording_of(options, frames), pair));
    }
    if (options.ros.on) {
      const std::string& prefix = options.ros.frame_prefix;
      observers.push_back(make_moment_publisher(make_ros_plan(options.ros),
                                                {prefix + frames.robot, prefix + frames.dock}, options.gate));
    }
  }
  if (!options.log.empty()) observers.push_back(std::make_unique<MomentLog>(options.log, out));
  return observers;
}

int run_stations(const Options& options, Console& console) {
  const InterruptWatch interrupt;
  StationPairingConfig config;
  config.largest_difference_ns = std::llround(options.largest_difference_ms * 1e6);
  StationRun run(config, std::llround(options.wait_ms * 1e6));
  std::mutex mutex;
  std::ostream& people = options.log == "-" ? console.err() : console.out();
  StationCommand robot(StationSide::robot, options, console, people, mutex, run);
  StationCommand dock(StationSide::dock, options, console, people, mutex, run);
  LinePrefix both_text(fmt::format("{:<6} ", "both"), people, mutex), err_text("", console.err(), mutex);
  std::ostream both(&both_text), err(&err_text);
  Console pair(both, err, false);
  MomentCheck* check = nullptr;
  const auto observers = observers_of(options, console.out(), pair, check);
  for (const auto& observer : observers) observer->begin();
  {
    const BothStations stations = {robot, dock, run};
    robot.start();
    dock.start();
    StationMoment moment;
    while (run.next(moment)) {
      const FusedPose fused = fuse(run.stations(), moment, options.gate);
      const BothCounts counts = run.counts();
      for (const auto& observer : observers) observer->observe({moment, fused, counts, run.is_live()});
    }
  }
  for (const auto& observer : observers) observer->finish(run.counts(), both);
  if (robot.complained() || dock.complained() || pair.complained()) return kBadInput;
  if (check != nullptr && !check->is_equal()) return kNoResult;
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
    if (options->ros.on) arguments.emplace_back("--ros");  // which others there need
    std::reverse(arguments.begin(), arguments.end());
    of_file.parse(std::move(arguments));
    exit_code = run_stations(*options, console);
  });
}

}  // namespace berth::cli
