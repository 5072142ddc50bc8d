#include "work/measure.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "berth/error.hpp"
#include "buffer_list.hpp"
#include "work/count_step.hpp"

namespace berth::work {
namespace {

bool is_processor(const Backend& backend) {
  const std::string name = backend.name();
  const DeviceInfo device = backend.device();
  const auto has = [&device](const char* part) {
    return (device.name + " " + device.driver).find(part) != std::string::npos;
  };
  return name == "reference" || name == "cpu" || name == "simd" || has("pthread") || has("Portable Computing") ||
         has("llvmpipe");
}

double us_on(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}
double wall_us() { return us_on(CLOCK_MONOTONIC); }

void must_finish(Backend& backend, Stream& stream) {
  if (!stream.finish()) throw Error(std::string(backend.name()) + ": the device was lost");
}

constexpr double kBudget_ms = 60;

/// A probe: steps of its own, replayed alone.
class Probe {
 public:
  explicit Probe(Backend& backend) : backend_(backend), buffers_(backend), stream_(backend.make_stream()) {}

  Buffer* make(std::size_t words) { return buffers_.make(words); }
  Buffer* make(const std::vector<u32>& words) {
    Buffer* buffer = buffers_.make(words.size());
    upload_at_start(backend_, *stream_, *buffer, words.data(), words.size() * 4);
    return buffer;
  }
  double replay_us(const std::vector<Step>& steps) {
    const std::unique_ptr<Plan> plan = backend_.record(steps);
    return least_us(backend_, kBudget_ms, [&] {
      stream_->replay(*plan);
      must_finish(backend_, *stream_);
    });
  }
  /// Uploads to `buffers` of `words` each.
  double upload_us(std::size_t words, int buffers) {
    std::vector<Buffer*> to;
    for (int i = 0; i < buffers; ++i) to.push_back(buffers_.make(words));
    const std::vector<u32> data(words * to.size(), 1);
    return least_us(backend_, kBudget_ms, [&] {
      const u32* from = data.data();
      for (Buffer* buffer : to) {
        stream_->upload(*buffer, from, words * 4);
        from += words;
      }
      must_finish(backend_, *stream_);
    });
  }

 private:
  Backend& backend_;
  BufferList buffers_;
  std::unique_ptr<Stream> stream_;
};

/// Next to nothing: one group that looks at one word.
Step tiny_step(Probe& probe) { return make_step(despeckle_params{1, 1}, {probe.make(1), probe.make(1)}, 1); }

void measure_launches(Backend& backend, Machine& machine) {
  constexpr int kMany = 64;
  Probe probe(backend);
  const Step tiny = tiny_step(probe);
  const double one = probe.replay_us({tiny});
  const double many = probe.replay_us(std::vector<Step>(kMany + 1, tiny));
  machine.launch_us = std::max((many - one) / kMany, 1e-3);
  machine.frame_us = std::max(one - machine.launch_us, 0.0);
  machine.copy_us = probe.upload_us(1, 1);
}

/// GB/s that uploads to `buffers` of `words` each move, read and written; of one small buffer also what an operation
/// moves that copies words. Where an upload passes through a buffer of the driver's, memory is faster than this.
double copy_gb_s(Backend& backend, const Machine& machine, int words, int buffers) {
  constexpr int kChannelWords = 64;  // of a pixel: a vector's length or more
  constexpr int kSmall = 1 << 18;
  Probe probe(backend);
  const double bytes = 8.0 * words * buffers;
  const std::size_t count = static_cast<std::size_t>(words);
  double us = probe.upload_us(count, buffers) - buffers * machine.copy_us;
  if (buffers == 1 && words <= kSmall) {
    const max_pool_params p{1, 1, words / kChannelWords, kChannelWords, 1, words / kChannelWords, 1, 1};
    const Step copy = make_step(p, {probe.make(count), probe.make(count)}, words);
    us = std::min(us, probe.replay_us({copy}) - machine.frame_us - machine.launch_us);
  }
  return bytes / std::max(us, 1e-3) / 1e3;
}

/// The cache ends where copies of twice the size are nearer to memory's rate than to the smallest's. Memory by several
/// buffers, since last-level caches are large.
void measure_copies(Backend& backend, Machine& machine) {
  constexpr int kSmall = 1 << 13;  // 64 KB read and written
  constexpr int kLarge = 1 << 22;  // 32 MB
  constexpr int kBuffers = 6;
  machine.cache_gb_s = copy_gb_s(backend, machine, kSmall, 1);
  machine.memory_gb_s = std::min(copy_gb_s(backend, machine, kLarge, kBuffers), machine.cache_gb_s);
  const double middle = std::sqrt(machine.cache_gb_s * machine.memory_gb_s);
  int words = kSmall;
  while (words < kLarge && copy_gb_s(backend, machine, words * 2, 1) >= middle) words *= 2;
  machine.cache_kb = words * 8.0 / 1024;
}

/// One contour of nodes in a scattered order: each step of the walk needs the one before.
double link_ns(Backend& backend, const Machine& machine) {
  constexpr int kNodes = 16384;  // steps are s16; 64 KB
  Probe probe(backend);
  std::vector<u32> nodes(kNodes);
  // An odd stride visits all of them.
  constexpr int kStride = 4099;
  for (int id = 0; id < kNodes; ++id) {
    const int next = (id + kStride) % kNodes;
    nodes[static_cast<std::size_t>(id)] = static_cast<u32>(next - id) << 16;
  }
  std::vector<u32> contours(CONTOUR_HEADER + CONTOUR_WORDS);
  contours[1] = 1;
  contours[CONTOUR_HEADER + 1] = kNodes;
  const Step walk =
      make_step(contour_trace_params{1}, {probe.make(nodes), probe.make(contours), probe.make(kNodes)}, 1);
  return std::max(probe.replay_us({walk}) - machine.frame_us - machine.launch_us, 1e-3) * 1e3 / kNodes;
}

/// Cycles that all but `kind` need, by the machine's prices.
double other_cycles(const StepWork& work, const Machine& machine, Kind kind) {
  const Counts& counts = work.slots[lockstep_index(machine.lockstep)];
  double cycles = 0;
  for (std::size_t k = 0; k < kKinds; ++k) {
    if (k != static_cast<std::size_t>(kind)) cycles += static_cast<double>(counts[k]) * machine.cycles[k];
  }
  return cycles;
}

/// The price of a kind from a step that is made of it: what the rest does not explain, a hundredth of a cycle at least.
double price_of(Kind kind, double us, const StepWork& work, const Machine& machine) {
  const double lanes_us = machine.units * machine.lanes * machine.clock_ghz * machine.busy_share * 1e3;
  const double count =
      static_cast<double>(work.slots[lockstep_index(machine.lockstep)][static_cast<std::size_t>(kind)]);
  // The rest is as much quicker there as the step itself, if it is: never more than half of the time.
  const double rest_us = std::min(other_cycles(work, machine, kind) / lanes_us, us / 2);
  return std::max((us - rest_us) * lanes_us / count, 0.01);
}

/// A step of the calibration that is long enough beside its launch, and not made of bytes.
struct Sample {
  const StepWork* work;
  double us;
};

/// Cycles a µs of each sample with that many items in lockstep, how much they differ (the mean of |ln| about all
/// samples' rate), and that rate.
struct Fit {
  double best = 0, all = 0, spread = 0;
};
Fit fit_rates(const std::vector<Sample>& samples, Machine machine, int lockstep) {
  machine.lockstep = lockstep;
  double cycles = 0, us = 0;
  Fit fit;
  std::vector<double> rates;
  for (const Sample& sample : samples) {
    const double mine = other_cycles(*sample.work, machine, Kind::bytes);
    cycles += mine;
    us += sample.us;
    rates.push_back(mine / sample.us);
    fit.best = std::max(fit.best, rates.back());
  }
  fit.all = cycles / us;
  for (const double rate : rates) fit.spread += std::fabs(std::log(rate / fit.all)) / static_cast<double>(rates.size());
  return fit;
}

/// From the steps of a docking frame: how many items seem to advance together, the best rate, which becomes the lanes'
/// clock, and that of all steps together, what they make use of. Then the price of bytes.
void measure_rates(Backend& backend, View2D<const u8> image, Machine& machine) {
  const std::unique_ptr<Backend> host = open_backend("cpu");
  const FrameLoad load = count_frame(*docking_frame(*host, image), *host);
  const std::unique_ptr<ModeFrame> frame = docking_frame(backend, image);
  const std::vector<double> times = step_times_us(backend, *frame, 15);
  std::vector<Sample> samples;
  Sample bytes{nullptr, 0};
  for (std::size_t i = 0; i < load.steps.size(); ++i) {
    const StepWork& work = load.steps[i].work;
    const double us = times[i] - machine.launch_us;
    if (us < machine.launch_us || us < 1) continue;
    if (work.op == Op::tile_extrema && bytes.work == nullptr) bytes = {&work, us};
    if (work.slots[0][static_cast<std::size_t>(Kind::bytes)] == 0) samples.push_back({&work, us});
  }
  if (samples.empty()) throw Error(std::string(backend.name()) + ": no operation takes long enough to be measured");
  Fit best;
  best.spread = 1e18;
  for (const int lockstep : kLockstep) {
    const Fit fit = fit_rates(samples, machine, lockstep);
    if (fit.spread >= best.spread) continue;
    best = fit;
    machine.lockstep = machine.lanes = lockstep;
  }
  machine.clock_ghz = best.best / (machine.units * machine.lanes * 1e3);
  machine.busy_share = best.all / best.best;
  machine.cycles[static_cast<std::size_t>(Kind::bytes)] =
      bytes.work != nullptr ? price_of(Kind::bytes, bytes.us, *bytes.work, machine) : 4;
}

/// A convolution of the size of the lite network's second, on the backend and counted.
void measure_dot(Backend& backend, Machine& machine) {
  const convolve_params p{1, 32, 32, 8, 32, 32, 16, 5, 5, 1, 1, 2, 2, 8, 16, 2};
  const auto step_on = [&p](Probe& probe) {
    return make_step(p,
                     {probe.make(32 * 32 * 8), probe.make(5 * 5 * 8 * 64), probe.make(128), probe.make(32 * 32 * 16)},
                     32 * 2 * 16);
  };
  const std::unique_ptr<Backend> host = open_backend("cpu");
  Probe counted(*host);
  const StepWork work = count_step(step_on(counted));
  Probe probe(backend);
  const double us = std::max(probe.replay_us({step_on(probe)}) - machine.frame_us - machine.launch_us, 1e-3);
  machine.cycles[static_cast<std::size_t>(Kind::dot)] = price_of(Kind::dot, us, work, machine);
}

/// What a step more takes in a plan of nothing but that step; long ones once, by themselves. Only a scan changes what
/// it reads, and none of its numbers is an address.
std::vector<double> repeated_step_times_us(Backend& backend, ModeFrame& frame, Stream& stream, int runs) {
  constexpr int kMore = 6;
  constexpr double kLong_us = 1000;
  std::vector<double> times;
  const auto least_of = [&](const std::vector<Step>& steps) {
    const std::unique_ptr<Plan> plan = backend.record(steps);
    double least = 1e18;
    for (int run = 0; run < runs; ++run) {
      const double start = device_us(backend);
      stream.replay(*plan);
      must_finish(backend, stream);
      least = std::min(least, device_us(backend) - start);
    }
    return least;
  };
  for (const Step& step : frame.steps()) {
    stream.replay(frame.plan());
    must_finish(backend, stream);
    const double once = least_of({step});
    times.push_back(once > kLong_us ? once
                                    : std::max(least_of(std::vector<Step>(kMore + 1, step)) - once, 0.0) / kMore);
  }
  return times;
}

}  // namespace

double device_us(const Backend& backend) { return is_processor(backend) ? us_on(CLOCK_PROCESS_CPUTIME_ID) : wall_us(); }

double least_us(const Backend& backend, double budget_ms, const std::function<void()>& run) {
  run();
  double least = 1e18;
  const double begun = wall_us();
  for (int i = 0; i < 3 || wall_us() - begun < budget_ms * 1e3; ++i) {
    const double start = device_us(backend);
    run();
    least = std::min(least, device_us(backend) - start);
  }
  return least;
}

std::vector<double> step_times_us(Backend& backend, ModeFrame& frame, int runs) {
  const std::unique_ptr<Stream> stream = backend.make_stream();
  frame.upload(*stream);
  stream->replay(frame.plan());
  must_finish(backend, *stream);
  if (is_processor(backend) || stream->time_steps(frame.plan()).empty()) {
    return repeated_step_times_us(backend, frame, *stream, runs);
  }
  std::vector<double> least(frame.steps().size(), 1e18);
  for (int run = 0; run < runs; ++run) {
    const std::vector<std::int64_t> told = stream->time_steps(frame.plan());
    if (told.empty()) throw Error(std::string(backend.name()) + ": the device was lost");
    for (std::size_t i = 0; i < least.size(); ++i) least[i] = std::min(least[i], static_cast<double>(told[i]) / 1e3);
  }
  return least;
}

double frame_time_us(Backend& backend, ModeFrame& frame, double budget_ms) {
  const std::unique_ptr<Stream> stream = backend.make_stream();
  return least_us(backend, budget_ms, [&] {
    frame.upload(*stream);
    stream->replay(frame.plan());
    frame.download(*stream);
    must_finish(backend, *stream);
  });
}

Machine measure_machine(Backend& backend, View2D<const u8> calibration) {
  Machine machine;
  const DeviceInfo device = backend.device();
  machine.name = device.name + ", " + device.driver;
  machine.backend = backend.name();
  machine.items_in_parallel = !is_processor(backend);
  // Taken, not measured: a quotient is the one operation that is slow everywhere.
  machine.cycles.fill(1);
  machine.cycles[static_cast<std::size_t>(Kind::divide)] = 8;
  measure_launches(backend, machine);
  measure_copies(backend, machine);
  machine.latency_ns = link_ns(backend, machine);
  measure_rates(backend, calibration, machine);
  measure_dot(backend, machine);
  machine.step_ns = 1 / machine.clock_ghz;
  return machine;
}

}  // namespace berth::work
