#include "stream.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "berth/error.hpp"
#include "camera_play.hpp"
#include "frame/result_digest.hpp"
#include "health_show.hpp"
#include "interrupt.hpp"
#include "marker_filters.hpp"
#include "source_arguments.hpp"
#include "stream_engine.hpp"
#include "stream_log.hpp"
#include "stream_show.hpp"
#include "stream_summary.hpp"
#include "systematic_show.hpp"

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
        show_(people_, options.log != "-" && console.out_is_terminal(), frames_expected()),
        errors_(options.engine),
        summary_(options),
        log_(options.log, console) {}

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
      show_.finish();
      sum_up(interrupt.came());
    }
    return {summary_.frames(), summary_.with_markers(), summary_.differing()};
  }

 private:
  /// At a camera's pace, all frames read beforehand.
  void play(const InterruptWatch& interrupt) {
    // What is wrong shows before the frames are read.
    make_pipeline_config(options_.pace, {}, tracking_of(options_));
    if (!options_.engine.lockstep.empty()) throw Error("--lockstep compares every frame; leave --fps out");
    std::vector<SourceFrame> frames = read_to_play(source_, options_.max_frames, console_, interrupt);
    if (frames.empty()) throw Error("the source has no frame to play");
    make_engine(frames.front());
    refuse_poses(stream_frame(frames.front()));
    const GrayImage& first = frames.front().image;
    const PipelineConfig config = stream_engine_->pipeline_config(first.width(), first.height());
    PacedPlay paced(std::move(frames), options_.pace, engine().backends(), config);
    paced.describe(people_);
    people_.flush();
    playing_ = &paced;
    paced.start();
    while (const PipelineFrame* frame = paced.next()) {
      gather_paced(stream_frame(paced.source_of(*frame)), *frame, paced.is_first_round(*frame));
      if (interrupt.came()) paced.end();
    }
    playing_ = nullptr;
    show_.finish();
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
    const PipelineConfig config = stream_engine_->pipeline_config(camera->width(), camera->height());
    CameraPlay live(*camera, options_.pace, engine().backends(), config, options_.max_frames);
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
    show_.finish();
    sum_up(interrupt.came(), &live);
  }

  void gather_paced(const StreamFrame& source, const PipelineFrame& frame, bool first_round) {
    if (frame.backend != paced_backend_) {
      const std::string before = engine().backends()[paced_backend_]->name();
      const std::string now = engine().backends()[frame.backend]->name();
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

  Engine& engine() { return stream_engine_->engine(); }
  HealthReport engine_health() const {
    return playing_ != nullptr ? playing_->engine() : stream_engine_->engine().health();
  }

  void make_engine(const SourceFrame& frame) {
    stream_engine_.emplace(options_, source_, frame, console_);
    const std::string backend = engine().describe();
    people_ << "backend " << backend << '\n';
    const DetectorConfig sized = engine().config_for(frame.image.width(), frame.image.height());
    for (const auto& observer : options_.observers) {
      observer->begin({frame.image.width(), frame.image.height(), sized, backend});
    }
  }

  /// `digest`: of the result before its poses were scaled.
  void tell_observers(const StreamFrame& frame, const FrameResult& result, u64 digest, const PipelineFrame* paced) {
    if (options_.observers.empty()) return;
    const std::optional<CameraModel> camera = stream_engine_->camera_of(frame);
    PipelineCounts counts;
    if (playing_ != nullptr) counts = playing_->counts();
    const Backend& backend = paced != nullptr ? *engine().backends()[paced->backend] : engine().backend();
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
    if (!stream_engine_) make_engine(frame);
    const StreamFrame shown = stream_frame(frame);
    refuse_poses(shown);
    // Not of what came through a pipeline: there it comes too late.
    if (options_.filter && engine().tracker() != nullptr && options_.behind == 0) {
      filters_.foretell(frame.stamp.mid_exposure_ns, stream_engine_->camera_of(shown), *engine().tracker());
    }
    const Backend* before = &engine().backend();
    const u64 returns = engine().health().returns;
    const TimedResult timed = engine().detect(frame.image.view(), frame.stamp);
    FrameResult result = timed.frame;
    if (engine().health().returns > returns) {
      console_.note(frame.label +
                    ": a backend that was left was opened anew and gives right answers; from this frame "
                    "on it is " +
                    engine().describe());
    } else if (&engine().backend() != before) {
      console_.note(frame.label + ": " + before->name() + " was left: " + engine().health().reason +
                    "; the frame was run again on " + engine().describe());
    }
    if (timed.difference) report_difference(frame.label, *timed.difference);
    tracked_ = timed.tracked;
    frame_ns_ = timed.wall_ns;
    if (tracked_ != nullptr) summary_.add_search(*tracked_, timed.cpu_ns);
    summary_.add_times(timed.wall_ns, timed.cpu_ns);
    gather(shown, result, timed.cpu_ns, nullptr, true);
  }

  void refuse_poses(const StreamFrame& frame) {
    const std::string refusal = engine().pose_refusal(frame.image.width, frame.image.height);
    if (!refusal.empty() && !refused_) console_.complain(frame.label + ": " + refusal);
    refused_ = refused_ || !refusal.empty();
  }

  /// Takes a frame's result into everything that was asked for. `paced` where it came through a pipeline. Errors and
  /// ways are of the first round alone: what is played for hours must not fill the memory.
  void gather(const StreamFrame& frame, FrameResult& result, std::int64_t cpu_ns, const PipelineFrame* paced,
              bool first_round) {
    const u64 digest = options_.observers.empty() ? 0 : digest_of(result);
    stream_engine_->scale_poses(result.detections, frame.truth);
    find_systematic(frame, result);
    if (options_.filter) filter(frame, result, first_round);
    tell_observers(frame, result, digest, paced);
    summary_.add(frame, result, engine().config(), first_round);
    if (log_.is_on()) {
      const MarkerFilters* const filters = options_.filter ? &filters_ : nullptr;
      log_.write({frame, result, systematic_, cpu_ns, paced, tracked_, filters, engine_health().mode},
                 engine().config());
    }
    // A camera's reader has no time to write what nobody can read.
    if (paced == nullptr || summary_.frames() % kShowEvery == 0) {
      show_.show(summary_.frames(), rate(), result, frame.truth, systematic_, engine().config());
    }
    if (result.status == FrameStatus::device_lost) {
      const HealthReport health = engine_health();
      const bool is_lost = health.wrong_answers + health.alterations == 0;
      throw Error(frame.label + ": " + (is_lost ? "the device was lost" : "no backend is left that can be believed (") +
                  (is_lost ? "" : health.reason + std::string(")")) + "; see berth doctor, or use --backend simd" +
                  (is_lost ? "" : " and a --fallback"));
    }
  }

  void filter(const StreamFrame& frame, const FrameResult& result, bool scored) {
    if (std::string_view(result.stamp.clock) == "none") {
      throw Error(frame.label +
                  ": frames without times cannot be filtered; leave --filter out, or use a video or a live source");
    }
    filters_.update(result, engine().config(), stream_engine_->camera_of(frame), frame.truth);
    if (scored) summary_.add_filtered(frame, filters_.as_detections());
  }

  void find_systematic(const StreamFrame& frame, const FrameResult& result) {
    systematic_.clear();
    for (const Detection& d : result.detections) {
      const double size_m = stream_engine_->size_of(d, frame.truth);
      systematic_.push_back(errors_.of(engine(), frame.image.width, frame.image.height, size_m, d));
    }
  }

  void report_difference(const std::string& label, const StageDifference& difference) {
    // The first in full; a broken driver may differ in every frame to come.
    if (summary_.add_difference() == 1)
      console_.note(label + ": the backends differ first in " + to_string(difference));
  }

  double rate() const {
    if (options_.pace.fps > 0) return options_.pace.fps;
    return options_.pace.stream ? live_fps_ : summary_.frames_per_second();
  }

  void sum_up(bool by_interrupt, const Play* paced = nullptr) {
    if (by_interrupt) people_ << "interrupted\n";
    summary_.print_counts(people_);
    if (paced != nullptr) {
      paced->sum_up(people_);
      if (log_.is_on()) log_.write(paced->summary());
    }
    if (paced != nullptr || stream_engine_) {
      print_health(people_, paced != nullptr ? paced->engine() : engine().health());
    }
    summary_.print_rest(people_, source_.health());
    log_.close(people_);
    if (stream_engine_) summary_.write_files(console_, people_, engine());
    for (const auto& observer : options_.observers) observer->finish(people_);
    people_.flush();
  }

  Source& source_;
  const StreamOptions& options_;
  Console& console_;
  std::ostream& people_;
  StreamShow show_;
  std::optional<StreamEngine> stream_engine_;
  SystematicErrors errors_;
  SystematicCovariances systematic_;  // of the frame at hand
  bool refused_ = false;
  std::size_t paced_backend_ = 0;  // that the pipeline's last frame was run on
  double live_fps_ = 0;            // a camera's results a second
  StreamSummary summary_;
  StreamLog log_;
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
