#include "paced_play.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <utility>

#include "berth/error.hpp"
#include "camera/bad_input.hpp"
#include "frame/digest.hpp"
#include "frame/result_digest.hpp"
#include "monotonic.hpp"
#include "pipeline/thread_setup.hpp"
#include "pipeline_show.hpp"
#include "source_arguments.hpp"

namespace berth::cli {
namespace {

constexpr const char* kCommandLine = "command line";
constexpr std::size_t kMostInMemory = 2'000'000'000;
constexpr std::int64_t kSampleEveryNs = 10'000'000'000;

Error bad_option(const char* option, const std::string& value, const std::string& remedy) {
  return bad_field(kCommandLine, option, value, remedy);
}

std::uint64_t frames_to_play(std::size_t frames, const PaceOptions& options) {
  return options.minutes > 0 ? static_cast<std::uint64_t>(std::ceil(options.minutes * 60 * options.fps)) : frames;
}

std::int64_t resident_kb() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t size = 0;
  std::int64_t resident = 0;
  statm >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE) / 1024;
}

double megabytes(std::size_t bytes) { return static_cast<double>(bytes) / 1e6; }

}  // namespace

std::vector<CLI::Option*> add_pace_options(CLI::App& command, PaceOptions& pace) {
  std::vector<CLI::Option*> added;
  const auto paced = [&](CLI::Option* option, const char* type) {
    option->type_name(type)->group(kPaceGroup);
    added.push_back(option);
  };
  paced(command.add_option("--slots", pace.slots, "frames under way at most, 2 or more")->capture_default_str(), "N");
  paced(command.add_option("--cores", pace.cores, "the device's core and the host's, e.g. 0,1; or one for both")
            ->delimiter(','),
        "A,B");
  paced(command.add_option("--realtime", pace.realtime, "SCHED_FIFO priority, 1 to 99, for what it is allowed to"),
        "P");
  paced(command.add_option("--deadline", pace.deadlines_ms, "later frames are counted, ms, one or two")
            ->delimiter(',')
            ->capture_default_str(),
        "MS,MS");
  return added;
}

PipelineConfig make_pipeline_config(const PaceOptions& options, DetectorConfig detector,
                                    std::optional<TrackerConfig> tracking) {
  if (!options.stream && (!(options.fps > 0) || options.fps > 100000)) {
    throw bad_option("--fps", std::to_string(options.fps), "give frames a second, above 0 and at most 100000");
  }
  if (!(options.minutes >= 0) || options.minutes > 60 * 24 * 365) {
    throw bad_option("--minutes", std::to_string(options.minutes), "give minutes, above 0 and at most a year");
  }
  PipelineConfig config;
  if (options.deadlines_ms.empty() || options.deadlines_ms.size() > config.deadlines_ns.size()) {
    throw bad_option("--deadline", std::to_string(options.deadlines_ms.size()) + " values", "give one or two, in ms");
  }
  for (std::size_t i = 0; i < config.deadlines_ns.size(); ++i) {
    const double ms = options.deadlines_ms[std::min(i, options.deadlines_ms.size() - 1)];
    if (!(ms > 0) || ms > 1e6) throw bad_option("--deadline", std::to_string(ms), "give ms, above 0");
    config.deadlines_ns[i] = std::llround(ms * 1e6);
  }
  config.detector = std::move(detector);
  config.slots = options.slots;
  if (tracking) {
    if (options.behind < 1 || options.behind >= options.slots) {
      throw bad_option("--behind", std::to_string(options.behind), "give 1 or more frames, fewer than --slots");
    }
    tracking->behind = options.behind;
    config.tracking = tracking;
  }
  config.cores = options.cores;
  config.realtime_priority = options.realtime;
  return config;
}

std::vector<SourceFrame> read_to_play(Source& source, std::uint64_t most, Console& console,
                                      const InterruptWatch& interrupt) {
  std::vector<SourceFrame> frames;
  std::size_t bytes = 0;
  while (most == 0 || frames.size() < most) {
    std::optional<SourceFrame> frame = next_readable(source, console, interrupt);
    if (!frame) break;
    const GrayImage& image = frame->image;
    const GrayImage& first = frames.empty() ? image : frames.front().image;
    if (image.width() != first.width() || image.height() != first.height()) {
      console.complain(fmt::format("{}: {}x{}, but a camera's frames have one size, here {}x{}; passed over",
                                   frame->label, image.width(), image.height(), first.width(), first.height()));
      continue;
    }
    bytes += static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
    if (bytes > kMostInMemory) {
      throw Error(fmt::format("the first {} frames take 2 GB already; play fewer by --max-frames", frames.size()));
    }
    frames.push_back(std::move(*frame));
  }
  return frames;
}

PacedPlay::PacedPlay(std::vector<SourceFrame> frames, const PaceOptions& options, const std::vector<Backend*>& backends,
                     const PipelineConfig& config)
    : frames_(std::move(frames)),
      options_(options),
      total_(frames_to_play(frames_.size(), options)),
      pipeline_(backends, frames_.front().image.width(), frames_.front().image.height(), config),
      camera_(options_.fps, total_, options_.realtime),
      seen_(frames_.size()) {
  resident_kb_.reserve(static_cast<std::size_t>(options_.minutes * 60e9 / static_cast<double>(kSampleEveryNs)) + 16);
}

PacedPlay::~PacedPlay() {
  camera_.end();
  camera_.join();
  if (options_.realtime > 0) make_ordinary();
}

void PacedPlay::start() {
  pipeline_.start();
  camera_.start(
      [this](std::uint64_t i, const FrameStamp& stamp) {
        return pipeline_.push(frames_[i % frames_.size()].image.view(), stamp);
      },
      [this] { pipeline_.close(); });
  // Or a busy machine keeps results from being read, and slots from getting free.
  if (options_.realtime > 0) make_realtime(std::max(1, options_.realtime - 1));
}

const PipelineFrame* PacedPlay::next() {
  const PipelineFrame* frame = pipeline_.next();
  if (frame != nullptr) {
    note_result(*frame);
  } else {
    camera_.join();
    pipeline_.stop();
  }
  sample_memory();
  return frame;
}

const SourceFrame& PacedPlay::source_of(const PipelineFrame& frame) const {
  return frames_[frame.result->stamp.sequence % frames_.size()];
}

void PacedPlay::note_result(const PipelineFrame& frame) {
  Seen& seen = seen_[frame.result->stamp.sequence % frames_.size()];
  const u64 digest = digest_of(*frame.result);
  if (seen.times == 0) seen.digest = digest;
  if (seen.digest != digest) ++differing_;
  ++seen.times;
}

void PacedPlay::sample_memory() {
  const std::int64_t now = monotonic_ns();
  if (now < next_sample_ns_) return;
  next_sample_ns_ = now + kSampleEveryNs;
  resident_kb_.push_back(resident_kb());
}

u64 PacedPlay::digest() const {
  u64 all = digest_words(nullptr, 0);
  for (const Seen& seen : seen_) {
    if (seen.times == 0) continue;
    const std::array<u32, 2> words = {static_cast<u32>(seen.digest), static_cast<u32>(seen.digest >> 32)};
    all = digest_words(words.data(), words.size(), all);
  }
  return all;
}

std::size_t PacedPlay::frames_seen() const {
  return static_cast<std::size_t>(
      std::count_if(seen_.begin(), seen_.end(), [](const Seen& seen) { return seen.times > 0; }));
}

void PacedPlay::describe(std::ostream& out) const {
  std::size_t bytes = 0;
  for (const SourceFrame& frame : frames_) {
    bytes += static_cast<std::size_t>(frame.image.width()) * static_cast<std::size_t>(frame.image.height());
  }
  out << fmt::format("camera      {:g} frames/s, {} frames from {} in memory ({:.1f} MB)\n", options_.fps, total_,
                     frames_.size(), megabytes(bytes));
  print_set_up(out, pipeline_.memory(), options_.cores, options_.realtime);
}

void PacedPlay::sum_up(std::ostream& out) const {
  const PipelineCounts counts = pipeline_.counts();
  print_counts(out, counts);
  out << fmt::format("; the camera's thread was late for {}\n", camera_.late());
  print_laps(out, pipeline_);
  print_late(out, options_.deadlines_ms, counts.late, counts.delivered);
  if (resident_kb_.size() > 1) {
    const auto at = static_cast<std::ptrdiff_t>(std::min<std::size_t>(6, resident_kb_.size() - 1));
    out << fmt::format("resident    {:.1f} MB at the start, {:.1f} after {} s, then {:.1f} to {:.1f}\n",
                       static_cast<double>(resident_kb_.front()) / 1e3,
                       static_cast<double>(resident_kb_[static_cast<std::size_t>(at)]) / 1e3, at * 10,
                       static_cast<double>(*std::min_element(resident_kb_.begin() + at, resident_kb_.end())) / 1e3,
                       static_cast<double>(*std::max_element(resident_kb_.begin() + at, resident_kb_.end())) / 1e3);
  }
  out << fmt::format("results     {:016x}, {} of {} frames seen, {} results unlike the first of their frame\n",
                     digest(), frames_seen(), frames_.size(), differing_);
}

Json PacedPlay::summary() const {
  const PipelineMemory memory = pipeline_.memory();
  Json json = to_json(pipeline_, options_.deadlines_ms);
  json["fps"] = options_.fps;
  json["camera_late"] = camera_.late();
  json["slots"] = memory.slots;
  json["device_bytes"] = memory.device_bytes;
  json["host_bytes"] = memory.host_bytes;
  json["resident_kb"] = resident_kb_;
  json["results"] = {{"digest", fmt::format("{:016x}", digest())},
                     {"frames", frames_.size()},
                     {"seen", frames_seen()},
                     {"differing", differing_}};
  return {{"summary", std::move(json)}};
}

}  // namespace berth::cli
