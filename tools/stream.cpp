#include "stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <set>
#include <string_view>

#include "berth/error.hpp"
#include "bundle_show.hpp"
#include "camera_play.hpp"
#include "frame/result_digest.hpp"
#include "frame_json.hpp"
#include "health_show.hpp"
#include "interrupt.hpp"
#include "live_view.hpp"
#include "marker_filters.hpp"
#include "source_arguments.hpp"
#include "stream_summary.hpp"
#include "systematic_show.hpp"
#include "target_show.hpp"
#include "truth_score.hpp"

namespace berth::cli {
namespace {

/// Results of a played camera from one that is shown to the next.
constexpr std::uint64_t kShowEvery = 10;

/// One run_stream: what it was asked for and what it has gathered so far.
class StreamRun {
 public:
  StreamRun(Source& source, const StreamOptions& options, Console& console)
      : source_(source),
        options_(options),
        console_(console),
        people_(options.log == "-" ? console.err() : console.out()),
        view_(people_, options.log != "-" && console.out_is_terminal(), frames_expected()),
        errors_(options.engine),
        summary_(options) {
    if (options.log.empty() || options.log == "-") return;
    log_.open(options.log, std::ios::binary);
    if (!log_) throw Error(options.log + ": the log cannot be written; check the folder and its permissions");
  }

  StreamSum run() {
    const InterruptWatch interrupt;
    if (options_.pace.fps != 0) {
      play(interrupt);
    } else if (options_.pace.stream) {
      play_camera(interrupt);
    } else {
      while (options_.max_frames == 0 || summary_.frames() < options_.max_frames) {
        const std::optional<SourceFrame> frame = next_readable(source_, console_, interrupt);
        if (!frame) break;
        handle(*frame);
      }
      view_.finish();
      sum_up(interrupt.came());
    }
    return {summary_.frames(), summary_.with_markers(), summary_.differing()};
  }

 private:
  /// At a camera's pace, all frames read beforehand.
  void play(const InterruptWatch& interrupt) {
    // What is wrong shows before the frames are read.
    make_pipeline_config(options_.pace, {}, tracking());
    if (!options_.engine.lockstep.empty()) throw Error("--lockstep compares every frame; leave --fps out");
    std::vector<SourceFrame> frames = read_to_play(source_, options_.max_frames, console_, interrupt);
    if (frames.empty()) throw Error("the source has no frame to play");
    const GrayImage& first = frames.front().image;
    make_engine(frames.front());
    refuse_poses(stream_frame(frames.front()));
    const DetectorConfig config = engine_->config_for(first.width(), first.height());
    PacedPlay paced(std::move(frames), options_.pace, engine_->backends(), pipeline_config(config));
    paced.describe(people_);
    people_.flush();
    playing_ = &paced;
    paced.start();
    while (const PipelineFrame* frame = paced.next()) {
      gather_paced(stream_frame(paced.source_of(*frame)), *frame, paced.is_first_round(*frame));
      if (interrupt.came()) paced.end();
    }
    playing_ = nullptr;
    view_.finish();
    sum_up(interrupt.came(), &paced);
  }

  /// A camera's frames, each written where the device takes it from.
  void play_camera(const InterruptWatch& interrupt) {
    auto* const camera = dynamic_cast<CameraSource*>(&source_);
    if (camera == nullptr) throw Error("--stream takes a camera's frames; play recordings by --fps");
    if (!options_.engine.lockstep.empty()) throw Error("--lockstep compares every frame; leave --stream out");
    SourceFrame like;
    like.image = GrayImage(camera->width(), camera->height());
    like.label = options_.engine.camera_file;
    make_engine(like);
    refuse_poses(stream_frame(like));
    const DetectorConfig config = engine_->config_for(camera->width(), camera->height());
    CameraPlay live(*camera, options_.pace, engine_->backends(), pipeline_config(config), options_.max_frames);
    live.describe(people_);
    people_.flush();
    playing_ = &live;
    live.start();
    const std::vector<TruthMarker> no_truth;
    const std::vector<TruthTarget> no_targets;
    while (!live.has_ended()) {
      if (const PipelineFrame* frame = live.next()) {
        live_fps_ = live.frames_per_second();
        gather_paced({camera->label_of(frame->result->stamp), frame->image, no_truth, no_targets}, *frame, true);
      }
      for (const std::string& complaint : live.take_complaints()) console_.complain(complaint);
      if (interrupt.came()) live.end();
    }
    playing_ = nullptr;
    view_.finish();
    sum_up(interrupt.came(), &live);
  }

  void gather_paced(const StreamFrame& source, const PipelineFrame& frame, bool first_round) {
    if (frame.backend != paced_backend_) {
      const std::string before = engine_->backends()[paced_backend_]->name();
      const std::string now = engine_->backends()[frame.backend]->name();
      console_.note(source.label + ": " +
                    (frame.backend < paced_backend_
                         ? now + " was opened anew and gives right answers; from this frame on it is " + now + " again"
                         : before + " was left: " + playing_->engine().reason + "; from this frame on it is " + now));
      paced_backend_ = frame.backend;
    }
    tracked_ = frame.tracked;
    if (tracked_ != nullptr) summary_.add_search(*tracked_, 0);
    FrameResult result = *frame.result;
    gather(source, result, 0, &frame, first_round);
  }

  std::optional<std::size_t> frames_expected() const {
    if (options_.pace.fps > 0 && options_.pace.minutes > 0) {
      return static_cast<std::size_t>(options_.pace.minutes * 60 * options_.pace.fps);
    }
    const std::optional<std::size_t> total = source_.size();
    if (options_.max_frames == 0) return total;
    return std::min<std::size_t>(options_.max_frames, total.value_or(options_.max_frames));
  }

  std::optional<HealthConfig> health() const {
    if (options_.known_answer_s == 0) return std::nullopt;
    HealthConfig health;
    health.known_answer_every_ns = std::llround(options_.known_answer_s * 1e9);
    if (options_.fail_back_s > 0) {
      RecoveryConfig recovery;
      recovery.open = reopen_;
      recovery.first_wait_ns = std::llround(options_.fail_back_s * 1e9);
      recovery.longest_wait_ns = std::max(recovery.longest_wait_ns, recovery.first_wait_ns);
      health.recovery = recovery;
    }
    return health;
  }

  HealthReport engine_health() const { return playing_ != nullptr ? playing_->engine() : engine_->health(); }

  PipelineConfig pipeline_config(const DetectorConfig& detector) const {
    PipelineConfig config = make_pipeline_config(options_.pace, detector, tracking());
    config.health = health();
    config.hang_ns = std::llround(options_.hang_ms * 1e6);
    return config;
  }

  std::optional<TrackerConfig> tracking() const {
    if (!options_.track) return std::nullopt;
    TrackerConfig tracking;
    if (options_.full_every > 0) tracking.full_every = options_.full_every;
    if (options_.behind > 0) tracking.behind = options_.behind;
    return tracking;
  }

  /// The engine is made for the first frame, since a simulated one tells families and sizes that were not given.
  void make_engine(const SourceFrame& frame) {
    EngineOptions engine_options = options_.engine;
    if (engine_options.families.empty()) {
      std::set<std::string> families;
      for (const TruthMarker& marker : frame.truth) families.insert(marker.family);
      engine_options.families.assign(families.begin(), families.end());
    }
    DetectorConfig config = make_config(engine_options);
    if (!config.camera) config.camera = source_.camera();
    size_given_ = config.marker_size_m > 0;
    // With sizes known by marker, poses are computed for one metre and scaled: t is proportional to the size.
    if (!size_given_ && !frame.truth.empty()) config.marker_size_m = 1;
    const bool has_sizes = size_given_ || !config.bundles.empty() || !config.disc_targets.empty();
    if (!config.camera && has_sizes) console_.note("no poses: --camera is missing");
    if (config.camera && !has_sizes && !(config.marker_size_m > 0)) console_.note("no poses: --size is missing");
    config.digests = options_.digests;
    EngineBackends opened = options_.open_backends(engine_options);
    reopen_ = opened.reopen;
    engine_.emplace(std::move(opened), std::move(config), engine_options.camera_fit, tracking(), health());
    const std::string backend = engine_->describe();
    people_ << "backend " << backend << '\n';
    const DetectorConfig sized = engine_->config_for(frame.image.width(), frame.image.height());
    for (const auto& observer : options_.observers) {
      observer->begin({frame.image.width(), frame.image.height(), sized, backend});
    }
  }

  /// `digest`: of the result before its poses were scaled.
  void tell_observers(const StreamFrame& frame, const FrameResult& result, u64 digest, const PipelineFrame* paced) {
    if (options_.observers.empty()) return;
    const std::optional<CameraModel> camera = camera_of(frame);
    PipelineCounts counts;
    if (playing_ != nullptr) counts = playing_->counts();
    const Backend& backend = paced != nullptr ? *engine_->backends()[paced->backend] : engine_->backend();
    const ObservedFrame observed{frame.label,
                                 frame.image,
                                 result,
                                 digest,
                                 Mode::docking,
                                 camera,
                                 tracked_,
                                 paced,
                                 frame.truth,
                                 frame.truth_targets,
                                 backend.name(),
                                 paced != nullptr ? 0 : frame_ns_,
                                 playing_ != nullptr ? playing_->health() : source_.health(),
                                 engine_health(),
                                 options_.filter ? &filters_ : nullptr,
                                 playing_ != nullptr ? &counts : nullptr};
    for (const auto& observer : options_.observers) observer->observe(observed);
  }

  void handle(const SourceFrame& frame) {
    if (!engine_) make_engine(frame);
    const StreamFrame shown = stream_frame(frame);
    refuse_poses(shown);
    // Not of what came through a pipeline: there it comes too late.
    if (options_.filter && engine_->tracker() != nullptr && options_.behind == 0) {
      filters_.foretell(frame.stamp.mid_exposure_ns, camera_of(shown), *engine_->tracker());
    }
    const Backend* before = &engine_->backend();
    const u64 returns = engine_->health().returns;
    const TimedResult timed = engine_->detect(frame.image.view(), frame.stamp);
    FrameResult result = timed.frame;
    if (engine_->health().returns > returns) {
      console_.note(frame.label +
                    ": a backend that was left was opened anew and gives right answers; from this frame "
                    "on it is " +
                    engine_->describe());
    } else if (&engine_->backend() != before) {
      console_.note(frame.label + ": " + before->name() + " was left: " + engine_->health().reason +
                    "; the frame was run again on " + engine_->describe());
    }
    if (timed.difference) report_difference(frame.label, *timed.difference);
    tracked_ = timed.tracked;
    frame_ns_ = timed.wall_ns;
    if (tracked_ != nullptr) summary_.add_search(*tracked_, timed.cpu_ns);
    summary_.add_times(timed.wall_ns, timed.cpu_ns);
    gather(shown, result, timed.cpu_ns, nullptr, true);
  }

  /// The camera file's, or what --camera-fit makes of it.
  std::optional<CameraModel> camera_of(const StreamFrame& frame) const {
    return engine_->camera_for(frame.image.width, frame.image.height);
  }

  void refuse_poses(const StreamFrame& frame) {
    const std::string refusal = engine_->pose_refusal(frame.image.width, frame.image.height);
    if (!refusal.empty() && !refused_) console_.complain(frame.label + ": " + refusal);
    refused_ = refused_ || !refusal.empty();
  }

  /// Takes a frame's result into everything that was asked for. `paced` where it came through a pipeline. Errors and
  /// ways are of the first round alone: what is played for hours must not fill the memory.
  void gather(const StreamFrame& frame, FrameResult& result, std::int64_t cpu_ns, const PipelineFrame* paced,
              bool first_round) {
    const u64 digest = options_.observers.empty() ? 0 : digest_of(result);
    scale_poses(result.detections, frame.truth);
    find_systematic(frame, result);
    if (options_.filter) filter(frame, result, first_round);
    tell_observers(frame, result, digest, paced);
    summary_.add(frame, result, engine_->config(), first_round);
    if (!options_.log.empty()) {
      Json line = to_json(result, frame.label, cpu_ns, frame.truth);
      for (std::size_t i = 0; i < systematic_.size(); ++i) add_systematic(systematic_[i], line["detections"][i]);
      if (paced != nullptr) add_times(*paced, line);
      if (const HealthReport engine = engine_health(); engine.mode != HealthMode::nominal) {
        line["health"] = name_of(engine.mode);
      }
      const std::vector<Bundle>& bundles = engine_->config().bundles;
      if (!bundles.empty()) line["bundles"] = to_json(result.bundles, bundles);
      const std::vector<DiscTarget>& targets = engine_->config().disc_targets;
      if (!result.disc_targets.empty()) line["targets"] = to_json(result.disc_targets, targets);
      for (const TruthTarget& target : frame.truth_targets) line["truth_targets"].push_back(to_json(target));
      if (options_.filter) line["filtered"] = filters_.to_json();
      if (tracked_ != nullptr) line["search"] = to_json(*tracked_);
      log() << to_line(line) << '\n';
    }
    // A camera's reader has no time to write what nobody can read.
    if (paced == nullptr || summary_.frames() % kShowEvery == 0) show(result, frame.truth);
    if (result.status == FrameStatus::device_lost) {
      const HealthReport engine = engine_health();
      const bool is_lost = engine.wrong_answers + engine.alterations == 0;
      throw Error(frame.label + ": " + (is_lost ? "the device was lost" : "no backend is left that can be believed (") +
                  (is_lost ? "" : engine.reason + std::string(")")) + "; see berth doctor, or use --backend simd" +
                  (is_lost ? "" : " and a --fallback"));
    }
  }

  std::ostream& log() { return options_.log == "-" ? console_.out() : log_; }

  /// A camera's frame has a latency in place of its own share of the processor's time.
  static void add_times(const PipelineFrame& frame, Json& line) {
    line.erase("ms");
    line["latency_ms"] = ms_of(frame.laps_ns[static_cast<std::size_t>(Lap::latency)]);
    for (const Lap lap : {Lap::wait, Lap::queue}) {
      line["stages_us"][name_of(lap)] = static_cast<double>(frame.laps_ns[static_cast<std::size_t>(lap)]) / 1e3;
    }
  }

  void filter(const StreamFrame& frame, const FrameResult& result, bool scored) {
    if (std::string_view(result.stamp.clock) == "none") {
      throw Error(frame.label +
                  ": frames without times cannot be filtered; leave --filter out, or use a video or a live source");
    }
    filters_.update(result, engine_->config(), camera_of(frame), frame.truth);
    if (scored) summary_.add_filtered(frame, filters_.as_detections());
  }

  void find_systematic(const StreamFrame& frame, const FrameResult& result) {
    systematic_.clear();
    for (const Detection& d : result.detections) {
      const TruthMarker* marker = in_bundle(d) ? nullptr : truth_of(d, frame.truth);
      const double size_m = marker != nullptr ? marker->size_m : marker_size_m(engine_->config(), *d.family, d.id);
      systematic_.push_back(errors_.of(*engine_, frame.image.width, frame.image.height, size_m, d));
    }
  }

  void report_difference(const std::string& label, const StageDifference& difference) {
    // The first in full; a broken driver may differ in every frame to come.
    if (summary_.add_difference() == 1)
      console_.note(label + ": the backends differ first in " + to_string(difference));
  }

  void scale_poses(std::vector<Detection>& detections, const std::vector<TruthMarker>& truth) const {
    for (Detection& detection : detections) {
      if (!detection.has_pose) continue;
      if (in_bundle(detection)) continue;
      const TruthMarker* marker = truth_of(detection, truth);
      if (marker != nullptr) {
        scale_pose(marker->size_m / engine_->config().marker_size_m, detection);
      } else if (!size_given_) {
        detection.has_pose = false;
      }
    }
  }

  /// Whether its pose goes by the size that its bundle gives it.
  bool in_bundle(const Detection& detection) const {
    const std::vector<Bundle>& bundles = engine_->config().bundles;
    return std::any_of(bundles.begin(), bundles.end(),
                       [&](const Bundle& bundle) { return bundle.find(*detection.family, detection.id) != nullptr; });
  }

  void show(const FrameResult& result, const std::vector<TruthMarker>& truth) {
    const std::size_t n = result.detections.size();
    std::string line = fmt::format("{:4.0f} fps  {} marker{}", rate(), n, n == 1 ? " " : "s");
    if (result.status == FrameStatus::overflow) line += ", overflow";
    std::vector<std::string> table;
    const Detection* largest = nullptr;
    std::string brief;
    for (std::size_t i = 0; i < result.detections.size(); ++i) {
      const Detection& d = result.detections[i];
      // A row fits 80 columns, without deviations: where there is a pose, the place in the image gives way to it.
      std::string place =
          d.has_pose ? place_of(d, truth) : fmt::format("({:7.2f}, {:7.2f}) px", d.center[0], d.center[1]);
      if (systematic_[i]) place += range_deviations(d, *systematic_[i]);
      table.push_back(fmt::format("  {:<14} {:>4}  {}", d.family->name, d.id, place));
      if (largest == nullptr || area_of(d) > area_of(*largest)) {
        largest = &d;
        brief = fmt::format("id {} {}", d.id, place);
      }
    }
    for (std::size_t i = 0; i < result.bundles.size(); ++i) {
      table.push_back("  " + describe(engine_->config().bundles[i].name, result.bundles[i]));
    }
    for (std::size_t i = 0; i < result.disc_targets.size(); ++i) {
      table.push_back("  " + describe(engine_->config().disc_targets[i], result.disc_targets[i]));
    }
    view_.show(summary_.frames(), line, table, brief);
  }

  double rate() const {
    if (options_.pace.fps > 0) return options_.pace.fps;
    return options_.pace.stream ? live_fps_ : summary_.frames_per_second();
  }

  static double area_of(const Detection& d) {
    double twice = 0;
    for (int i = 0; i < 4; ++i) {
      const std::array<double, 2>&a = d.corners[i], &b = d.corners[(i + 1) % 4];
      twice += a[0] * b[1] - b[0] * a[1];
    }
    return std::abs(twice) / 2;
  }

  static std::string place_of(const Detection& d, const std::vector<TruthMarker>& truth) {
    const std::array<double, 3>& t = d.pose.t;
    std::string text = fmt::format("xyz {:+.4f} {:+.4f} {:.4f} m", t[0], t[1], t[2]);
    if (const TruthMarker* marker = truth_of(d, truth)) {
      text += fmt::format(", off {:.2f} mm {:.2f} deg", distance_m(d.pose, marker->pose) * 1000,
                          angle_deg(d.pose, marker->pose));
    }
    return text;
  }

  void sum_up(bool by_interrupt, const Play* paced = nullptr) {
    if (by_interrupt) people_ << "interrupted\n";
    summary_.print_counts(people_);
    if (paced != nullptr) {
      paced->sum_up(people_);
      if (!options_.log.empty()) log() << to_line(paced->summary()) << '\n';
    }
    if (paced != nullptr || engine_) {
      print_health(people_, paced != nullptr ? paced->engine() : engine_->health());
    }
    summary_.print_rest(people_, source_.health());
    if (!options_.log.empty() && options_.log != "-") {
      log_.close();
      // Complained of and not thrown: recordings and views are yet to be ended.
      if (log_) {
        people_ << "log         " << options_.log << '\n';
      } else {
        console_.complain(options_.log + ": writing the log failed; check the disk's space");
      }
    }
    if (engine_) summary_.write_files(console_, people_, *engine_);
    for (const auto& observer : options_.observers) observer->finish(people_);
    people_.flush();
  }

  Source& source_;
  const StreamOptions& options_;
  Console& console_;
  std::ostream& people_;
  LiveView view_;
  std::ofstream log_;
  std::optional<Engine> engine_;
  std::function<std::unique_ptr<Backend>(std::size_t)> reopen_;  // those of the engine
  SystematicErrors errors_;
  std::vector<std::optional<std::array<double, 36>>> systematic_;  // of the frame's detections
  bool size_given_ = false, refused_ = false;
  std::size_t paced_backend_ = 0;  // that the pipeline's last frame was run on
  double live_fps_ = 0;            // a camera's results a second
  StreamSummary summary_;
  MarkerFilters filters_;
  const TrackedFrame* tracked_ = nullptr;  // of the frame at hand
  std::int64_t frame_ns_ = 0;              // its time by the wall clock
  const Play* playing_ = nullptr;          // while frames come through a pipeline
};

}  // namespace

StreamSum run_stream(Source& source, const StreamOptions& options, Console& console) {
  return StreamRun(source, options, console).run();
}

}  // namespace berth::cli
