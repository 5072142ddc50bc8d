#include "soak_run.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <memory>
#include <sstream>

#include "berth/error.hpp"
#include "interrupt.hpp"
#include "pipeline/thread_setup.hpp"
#include "recorder.hpp"
#include "recording/recover.hpp"
#include "recording_setup.hpp"
#include "sim/scenario.hpp"
#include "stream.hpp"
#include "thread_stop.hpp"

namespace berth::cli {
namespace {

/// Between known answers, s: a scenario takes a second or so.
constexpr double kKnownAnswerS = 0.3;
/// Nothing from a device for so long is a hang; so soon one that was left is tried again.
constexpr double kHangMs = 250, kFailBackS = 0.05;

/// A file system that is full after so many bytes of a file, while it lives.
class FullDisk {
 public:
  explicit FullDisk(u64 bytes) {
    if (bytes == 0) return;
    is_set_ = getrlimit(RLIMIT_FSIZE, &usual_) == 0;
    rlimit small = usual_;
    small.rlim_cur = bytes;
    before_ = std::signal(SIGXFSZ, SIG_IGN);
    is_set_ = is_set_ && setrlimit(RLIMIT_FSIZE, &small) == 0;
  }
  ~FullDisk() { lift(); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  void lift() {
    if (!is_set_) return;
    setrlimit(RLIMIT_FSIZE, &usual_);
    std::signal(SIGXFSZ, before_);
    is_set_ = false;
  }

 private:
  rlimit usual_ = {};
  void (*before_)(int) = SIG_DFL;
  bool is_set_ = false;
};

/// Stops the pipeline's threads in turn, at the frames that the scenario says.
class Starver final : public FrameObserver {
 public:
  explicit Starver(const std::vector<u64>& frames) : frames_(frames) {}
  void observe(const ObservedFrame&) override {
    constexpr std::array<const char*, 3> kThreads = {"berth-host", "berth-device", "berth-camera"};
    const u64 frame = seen_++;
    if (std::find(frames_.begin(), frames_.end(), frame) == frames_.end()) return;
    if (stop_thread(kThreads[stopped_ % kThreads.size()])) ++stopped_;
  }
  u64 stopped() const { return stopped_; }

 private:
  const std::vector<u64>& frames_;
  u64 seen_ = 0, stopped_ = 0;
};

class ScenarioRun {
 public:
  ScenarioRun(const SoakScenario& scenario, const SoakBackends& backends) : s_(scenario), backends_(backends) {}

  SoakOutcome run(const AlterTruth& alter) {
    render(alter);
    FaultyFilm film(std::move(pictures_), s_.film);
    SoakSource source(film, camera_);
    play(film, source);
    if (outcome_.interrupted) return std::move(outcome_);
    account(film, source);
    if (s_.record) check_recording();
    note_kinds();
    return std::move(outcome_);
  }

 private:
  void complain(const std::string& what) { outcome_.violations.push_back({s_.number, std::nullopt, what}); }
  std::string path(const char* name) const { return folder_.path() + "/" + name; }

  void render(const AlterTruth& alter) {
    const std::unique_ptr<Source> scene = open_scenario(write_scenario(s_, folder_.path()));
    while (std::optional<SourceFrame> frame = scene->next()) {
      if (alter) alter(frame->truth);
      pictures_.push_back(std::move(frame->image));
      truths_.push_back(std::move(frame->truth));
    }
    camera_ = *scene->camera();
  }

  StreamOptions stream_options() const {
    StreamOptions options;
    options.engine.families = {s_.family};
    options.engine.size = fmt::format("{:.9f}", s_.size_m);
    options.engine.corners = s_.corners;
    options.engine.pose = s_.pose;
    // Soft decoding of ArUco's families has a false marker in 50,000 frames (docs/reliability.md).
    if (s_.family.rfind("aruco", 0) == 0) options.engine.max_hamming = 0;
    options.engine.backend = s_.backend;
    if (s_.bundle) options.engine.bundle_files = {write_bundle_of(s_, folder_.path())};
    options.open_backends = [this](const EngineOptions&) { return backends_.lend(s_); };
    if (s_.lockstep) options.engine.lockstep = s_.backend + "," + s_.second;
    options.digests = s_.digests;
    options.filter = s_.filter;
    options.track = s_.track;
    options.max_frames = s_.frames;
    if (s_.known_answers) options.known_answer_s = kKnownAnswerS;
    if (s_.fail_back) options.fail_back_s = kFailBackS;
    if (s_.backend_fault == BackendFault::hung) options.hang_ms = kHangMs;
    options.pace.stream = s_.in_real_time;
    // For its counts at the end.
    if (s_.in_real_time) options.log = path("log.jsonl");
    return options;
  }

  void play(FaultyFilm& film, SoakSource& source) {
    StreamOptions options = stream_options();
    const auto check =
        std::make_shared<SoakCheck>(s_, source, film, truths_, backends_.at(s_.second), outcome_.violations);
    const auto starver = std::make_shared<Starver>(s_.starved);
    options.observers = {check, starver};
    std::ostringstream out, err;
    Console console(out, err, false);
    try {
      if (s_.record) {
        RecordOptions record;
        record.file = path("run.mcap");
        record.pictures = s_.recorded;
        // What replays it opens a backend by its name.
        options.observers.push_back(
            std::make_shared<Recorder>(record, describe_run(options, "film"), s_.in_real_time, camera_, console));
      }
      FullDisk disk(s_.record ? s_.disk_bytes : 0);
      const StreamSum sum = run_stream(source, options, console);
      disk.lift();
      if (sum.differing > 0) complain(fmt::format("{} frames differ in lockstep", sum.differing));
    } catch (const std::exception& error) {
      complain(std::string("the stream ended: ") + error.what());
    }
    outcome_.interrupted = out.str().find("interrupted\n") != std::string::npos;
    SoakTally& tally = outcome_.tally;
    tally.scenarios = 1;
    tally.frames = check->frames();
    tally.compared = check->compared();
    tally.poses = check->poses();
    tally.threads_stopped = starver->stopped();
    tally.devices_lost = s_.backend_fault == BackendFault::lost ? 1 : 0;
    tally.devices_hung = s_.backend_fault == BackendFault::hung ? 1 : 0;
    tally.devices_stalled = s_.backend_fault == BackendFault::stalled ? 1 : 0;
    tally.failed_over = check->failed_over() ? 1 : 0;
    tally.returned = check->returns() > 0 ? 1 : 0;
    read_complaints(err.str());
  }

  /// What was said: a camera that went away, a device that was left, a disk that is full, and nothing else.
  void read_complaints(const std::string& said) {
    std::istringstream lines(said);
    for (std::string line; std::getline(lines, line);) {
      const auto has = [&](const char* words) { return line.find(words) != std::string::npos; };
      if (has("film: the camera is lost") || has("film: the camera cannot be opened") ||
          has("film: the camera is not back yet")) {
        continue;
      }
      if (has(" was left: ") && s_.loses_backend()) continue;
      if (has(" opened anew and gives right answers") && s_.fail_back) continue;
      // A resized frame's.
      if (has("no pose; use images as the camera was calibrated")) continue;
      if (s_.disk_bytes > 0 && has("run.mcap: ") && has("free some space")) {
        is_disk_full_ = true;
        continue;
      }
      // So is it for the log.
      if (s_.disk_bytes > 0 && has("log.jsonl: writing the log failed")) {
        is_log_cut_ = true;
        continue;
      }
      complain("it said: " + line);
    }
  }

  /// Every frame that the camera gave has a result or was counted, by the right name.
  void account(const FaultyFilm& film, const SoakSource& source) {
    SoakTally& tally = outcome_.tally;
    tally.camera_faults = film.begun();
    const SourceHealth counted = source.health(), wanted = film.expected();
    tally.camera = counted;
    // A machine that held a thread up for a second sets the camera's watchdog off, and the rest is counted otherwise.
    const bool was_held_up = counted.reopened > wanted.reopened;
    const auto expect = [&](const char* name, u64 got, u64 want) {
      if (got != want && !was_held_up) complain(fmt::format("the camera counts {} {}, of {}", got, name, want));
    };
    expect("lost frames", counted.lost, wanted.lost);
    expect("incomplete frames", counted.incomplete, wanted.incomplete);
    expect("repeated frames", counted.repeated, wanted.repeated);
    expect("misdated frames", counted.misdated, wanted.misdated);
    expect("skipped frames", counted.skipped, 0);
    if (counted.reopened < wanted.reopened) expect("times it was opened again", counted.reopened, wanted.reopened);
    const u64 lost_at = static_cast<u64>(s_.backend_fault_frame);
    // Frames before it may have been dropped, or searched in windows, which have plans of their own.
    const bool must_fail_over = s_.backend_fault == BackendFault::lost && !s_.in_real_time && !s_.track;
    if (must_fail_over && tally.frames > lost_at + 2 && tally.failed_over == 0) complain("a lost device was not left");
    // The pipeline's counts stand at the log's end.
    if (is_log_cut_) return;
    u64 offered = tally.frames, delivered = tally.frames;
    if (s_.in_real_time) read_counts(offered, delivered);
    if (offered != source.handed_on_in_all()) {
      complain(fmt::format("{} frames were offered, and {} handed on", offered, source.handed_on_in_all()));
    }
    if (delivered != tally.frames) {
      complain(fmt::format("{} frames were delivered, and {} came out", delivered, tally.frames));
    }
  }

  void read_counts(u64& offered, u64& delivered) {
    std::ifstream log(path("log.jsonl"));
    std::string line, last;
    while (std::getline(log, line)) last = line;
    const Json json = Json::parse(last, nullptr, false);
    if (json.is_discarded() || !json.contains("summary")) {
      complain("the log has no summary");
      return;
    }
    const Json& summary = json["summary"];
    offered = summary.at("offered");
    delivered = summary.at("delivered");
    for (const auto& [cause, frames] : summary.at("dropped").items()) outcome_.tally.dropped += frames.get<u64>();
    if (offered != delivered + outcome_.tally.dropped) complain("frames offered are not those delivered and dropped");
  }

  /// A recording runs again to the same bits; after a full disk what there is of it does, and can be made whole.
  void check_recording() {
    SoakTally& tally = outcome_.tally;
    ++tally.recordings;
    tally.disks_full += is_disk_full_ ? 1 : 0;
    std::string file = path("run.mcap");
    try {
      if (!mcap::examine(file).whole) {
        if (!is_disk_full_) complain("the recording is not whole");
        const std::string saved = path("saved.mcap");
        mcap::recover(file, saved, "berth soak");
        file = saved;
        ++tally.recovered;
      }
    } catch (const Error& error) {
      complain(std::string("the recording cannot be recovered: ") + error.what());
      return;
    }
    std::ostringstream out, err;
    Console console(out, err, false);
    const std::string on = s_.backend == "simd" ? "cpu" : "simd";
    const std::array<const char*, 5> words = {"berth", "replay", file.c_str(), "--backend", on.c_str()};
    const int exit_code = run_command(static_cast<int>(words.size()), words.data(), console);
    const bool is_equal = out.str().find("each equal to the recording") != std::string::npos;
    const bool is_empty = err.str().find("it has no frame to compare") != std::string::npos ||
                          err.str().find("the source has no frame") != std::string::npos;
    ++tally.replayed;
    // In real time pictures may be missing, which a replay tells; and nothing may be whole before a disk is full.
    if (out.str().find(" differ;") != std::string::npos) {
      complain("the replay differs: " + out.str().substr(out.str().rfind("replay ")));
    } else if (!is_equal && !s_.in_real_time && !(is_disk_full_ && is_empty)) {
      complain(fmt::format("the replay ended with {}: {}{}", exit_code, err.str(), out.str()));
    }
  }

  void note_kinds() {
    std::map<std::string, u64>& kinds = outcome_.tally.kinds;
    const auto note = [&](bool is_so, const std::string& kind) {
      if (is_so) ++kinds[kind];
    };
    note(true, s_.family);
    note(true, fmt::format("{}x{}", s_.width, s_.height));
    note(true, s_.lens + " lens");
    note(true, "on " + s_.backend);
    note(true, "compared with " + s_.second);
    note(true, "corners by " + s_.corners);
    note(s_.pose == "paper", "the paper's pose");
    note(s_.in_real_time, "through the pipeline, in real time");
    note(s_.lockstep, "in lockstep");
    note(s_.track, "tracked");
    note(s_.filter, "filtered");
    note(s_.bundle, "a bundle");
    note(s_.known_answers, "known answers, memory checked");
    note(s_.digests, "digests of all stages");
  }

  const SoakScenario& s_;
  const SoakBackends& backends_;
  const RestoredFiles folder_;
  std::vector<GrayImage> pictures_;
  std::vector<std::vector<TruthMarker>> truths_;
  CameraModel camera_;
  bool is_disk_full_ = false, is_log_cut_ = false;
  SoakOutcome outcome_;
};

}  // namespace

SoakOutcome run_scenario(const SoakScenario& scenario, const SoakBackends& backends, const AlterTruth& alter) {
  return ScenarioRun(scenario, backends).run(alter);
}

}  // namespace berth::cli
