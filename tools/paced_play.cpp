#include "paced_play.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <fstream>
#include <future>
#include <utility>

#include "berth/error.hpp"
#include "camera/bad_input.hpp"
#include "frame/digest.hpp"
#include "monotonic.hpp"
#include "pipeline/thread_setup.hpp"
#include "result_digest.hpp"
#include "source_arguments.hpp"

namespace berth::cli {
namespace {

constexpr const char* kCommandLine = "command line";
constexpr std::size_t kMostInMemory = 2'000'000'000;
constexpr std::int64_t kSampleEveryNs = 10'000'000'000;
constexpr std::array<std::pair<const char*, double>, 3> kQuantiles = {{{"p50", 0.5}, {"p99", 0.99}, {"p99.9", 0.999}}};

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

PipelineConfig make_pipeline_config(const PaceOptions& options, DetectorConfig detector,
                                    std::optional<TrackerConfig> tracking) {
  if (!(options.fps > 0) || options.fps > 100000) {
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
      seen_(frames_.size()) {
  resident_kb_.reserve(static_cast<std::size_t>(options_.minutes * 60e9 / static_cast<double>(kSampleEveryNs)) + 16);
}

PacedPlay::~PacedPlay() {
  ended_ = true;
  if (camera_.joinable()) camera_.join();
  if (options_.realtime > 0) make_ordinary();
}

void PacedPlay::start() {
  pipeline_.start();
  std::promise<void> ready;
  std::future<void> set = ready.get_future();
  camera_ = std::thread([this, ready = std::move(ready)]() mutable {
    try {
      name_thread("berth-camera");
      if (options_.realtime > 0) make_realtime(options_.realtime);
      ready.set_value();
    } catch (...) {
      ready.set_exception(std::current_exception());
      return;
    }
    film();
    pipeline_.close();
  });
  set.get();
  // Or a busy machine keeps results from being read, and slots from getting free.
  if (options_.realtime > 0) make_realtime(std::max(1, options_.realtime - 1));
}

void PacedPlay::film() {
  const auto began = std::chrono::steady_clock::now();
  const double period_ns = 1e9 / options_.fps;
  for (std::uint64_t i = 0; i < total_ && !ended_; ++i) {
    const std::chrono::nanoseconds since(static_cast<std::int64_t>(static_cast<double>(i) * period_ns));
    const auto due = began + since;
    std::this_thread::sleep_until(due);
    FrameStamp stamp;
    stamp.sequence = i;
    stamp.clock = "monotonic";
    stamp.mid_exposure_ns = std::chrono::nanoseconds(due.time_since_epoch()).count();
    stamp.exposure_start_ns = stamp.mid_exposure_ns;
    stamp.arrival_ns = monotonic_ns();
    if (static_cast<double>(stamp.arrival_ns - stamp.mid_exposure_ns) > period_ns) ++camera_late_;
    if (!pipeline_.push(frames_[i % frames_.size()].image.view(), stamp)) return;
  }
}

const PipelineFrame* PacedPlay::next() {
  const PipelineFrame* frame = pipeline_.next();
  if (frame != nullptr) {
    note_result(*frame);
  } else {
    if (camera_.joinable()) camera_.join();
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
  const PipelineMemory memory = pipeline_.memory();
  out << fmt::format("camera      {:g} frames/s, {} frames from {} in memory ({:.1f} MB)\n", options_.fps, total_,
                     frames_.size(), megabytes(bytes));
  out << fmt::format("pipeline    {} slots: {:.1f} MB for the device, {:.1f} MB for the host, no more after this",
                     memory.slots, megabytes(memory.device_bytes), megabytes(memory.host_bytes));
  if (!options_.cores.empty()) out << fmt::format("; cores {}", fmt::join(options_.cores, ", "));
  if (options_.realtime > 0) out << fmt::format("; SCHED_FIFO {}", options_.realtime);
  out << '\n';
}

void PacedPlay::sum_up(std::ostream& out) const {
  const PipelineCounts counts = pipeline_.counts();
  out << fmt::format("{} frames offered, {} delivered, {} dropped", counts.offered, counts.delivered,
                     counts.all_dropped());
  if (counts.all_dropped() > 0) {
    out << fmt::format(" (waiting for device {}, host {}, reader {})", counts.dropped[0], counts.dropped[1],
                       counts.dropped[2]);
  }
  if (counts.run_again > 0) out << fmt::format(", {} run again on another backend", counts.run_again);
  out << fmt::format("; the camera's thread was late for {}\n", camera_late_.load());
  out << fmt::format("{:<11} {:>9} {:>9} {:>9} {:>9}  ms\n", "", "p50", "p99", "p99.9", "max");
  for (std::size_t i = 0; i < kLaps; ++i) {
    const LatencyHistogram& times = pipeline_.times(static_cast<Lap>(i));
    if (times.max() == 0) continue;
    out << fmt::format("{:<11}", name_of(static_cast<Lap>(i)));
    for (const auto& [name, share] : kQuantiles) out << fmt::format(" {:>9.3f}", ms_of(times.quantile(share)));
    out << fmt::format(" {:>9.3f}\n", ms_of(times.max()));
  }
  for (std::size_t i = 0; i < options_.deadlines_ms.size(); ++i) {
    out << fmt::format("{} {:g} ms: {} of {}", i == 0 ? "later than" : "; than", options_.deadlines_ms[i],
                       counts.late[i], counts.delivered);
  }
  out << '\n';
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
  const PipelineCounts counts = pipeline_.counts();
  const PipelineMemory memory = pipeline_.memory();
  Json json = {{"fps", options_.fps},
               {"offered", counts.offered},
               {"delivered", counts.delivered},
               {"run_again", counts.run_again},
               {"camera_late", camera_late_.load()}};
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    json["dropped"][name_of(static_cast<DropCause>(i))] = counts.dropped[i];
  }
  for (std::size_t i = 0; i < options_.deadlines_ms.size(); ++i) {
    json["late"].push_back({{"deadline_ms", options_.deadlines_ms[i]}, {"frames", counts.late[i]}});
  }
  for (std::size_t i = 0; i < kLaps; ++i) {
    const LatencyHistogram& times = pipeline_.times(static_cast<Lap>(i));
    Json& row = json["times_ms"][name_of(static_cast<Lap>(i))];
    for (const auto& [name, share] : kQuantiles) row[name] = ms_of(times.quantile(share));
    row["max"] = ms_of(times.max());
  }
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
