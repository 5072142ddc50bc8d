#include "verify/chaos.hpp"

#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <optional>

#include "berth/error.hpp"
#include "berth/lockstep.hpp"
#include "frame/detector_parts.hpp"
#include "frame/result_digest.hpp"
#include "frame/stages.hpp"
#include "frame/traffic.hpp"
#include "health/known_answer.hpp"
#include "health/memory_scrub.hpp"
#include "sim/random.hpp"
#include "support/faulty_backend.hpp"
#include "verify/chaos_scenes.hpp"

namespace berth {
namespace {

constexpr std::size_t kScenes = 16;
/// A child hangs that takes so many times the processor time of a frame without a fault.
constexpr std::clock_t kHangFactor = 60;
/// Of the wall clock, for what waits for something.
constexpr unsigned kHangSeconds = 60;

/// What a child says by its exit code. Everything else, a sanitizer's code too, is a crash.
enum Said : int {
  kSaid = 64,
  kChanged = 1,
  kLockstep = 2,
  kStatus = 4,
  kScrub = 8,
  kKnownAnswer = 16,
  kWrongPose = 32,
};

/// Numbers of their own for each flip: splitmix64.
class Dice {
 public:
  Dice(u64 seed, u64 index) : state_(seed * 0x9e3779b97f4a7c15u + index * 0xd1342543de82ef95u) {}
  std::size_t below(std::size_t count) {
    const u64 bits = sim::scatter(state_);
    state_ += 0x9e3779b97f4a7c15u;
    return static_cast<std::size_t>(bits % count);
  }

 private:
  u64 state_;
};

/// Memory that a step writes, or that a frame's results lie in: where it is flipped, and how many words are used.
struct Target {
  int step;
  int argument;
  std::size_t words;
};

struct Scene {
  ChaosScene picture;
  u64 digest = 0;
  FrameStatus status = FrameStatus::no_target;
  std::vector<Target> pixels, intermediate, results;
};

/// Flips of a region come in runs: most of one child's leave it as it was.
ChaosRegion region_of(u64 index) { return static_cast<ChaosRegion>(index / kChaosRun % kChaosRegions); }

/// One flip of which a child said so much; -1 where it ended the child.
void count(int said, ChaosTally& tally) {
  ++tally.flips;
  if (said < 0) {
    ++tally.by_crash;
    ++tally.in_lockstep;
    return;
  }
  if ((said & kChanged) == 0) {
    ++tally.masked;
    if ((said & kLockstep) != 0) ++tally.seen_masked;
    return;
  }
  const bool is_wrong_pose = (said & kWrongPose) != 0;
  const bool is_late = (said & (kScrub | kKnownAnswer)) != 0;
  if ((said & kStatus) != 0) {
    ++tally.by_status;
  } else {
    ++((said & kScrub) != 0 ? tally.by_scrub : (said & kKnownAnswer) != 0 ? tally.by_known_answer : tally.silent);
    if (is_wrong_pose) ++(is_late ? tally.late_wrong_pose : tally.wrong_pose);
  }
  if ((said & (kLockstep | kStatus)) != 0) {
    ++tally.in_lockstep;
  } else {
    ++(is_late ? tally.lockstep_late : tally.lockstep_silent);
    if (is_wrong_pose) ++tally.lockstep_wrong_pose;
  }
}

/// One of the blocks, each by its size.
const ConstantMemory& choose(const std::vector<ConstantMemory>& blocks, Dice& dice) {
  std::size_t all = 0;
  for (const ConstantMemory& block : blocks) all += block.bytes;
  std::size_t at = dice.below(all);
  for (const ConstantMemory& block : blocks) {
    if (at < block.bytes) return block;
    at -= block.bytes;
  }
  return blocks.back();
}

}  // namespace

const char* name_of(ChaosRegion region) {
  static constexpr std::array<const char*, kChaosRegions> kNames = {"image",   "pixels", "intermediate",
                                                                    "results", "tables", "launches"};
  return kNames[static_cast<std::size_t>(region)];
}

ChaosTally ChaosReport::total() const {
  ChaosTally sum;
  for (const ChaosTally& t : regions) {
    sum.flips += t.flips;
    sum.masked += t.masked;
    sum.by_status += t.by_status;
    sum.by_crash += t.by_crash;
    sum.by_scrub += t.by_scrub;
    sum.by_known_answer += t.by_known_answer;
    sum.silent += t.silent;
    sum.late_wrong_pose += t.late_wrong_pose;
    sum.wrong_pose += t.wrong_pose;
    sum.in_lockstep += t.in_lockstep;
    sum.lockstep_late += t.lockstep_late;
    sum.lockstep_silent += t.lockstep_silent;
    sum.lockstep_wrong_pose += t.lockstep_wrong_pose;
    sum.seen_masked += t.seen_masked;
  }
  return sum;
}

struct ChaosCampaign::Impl {
  explicit Impl(Backend& behind)
      : faulty(behind, {}),
        both(faulty, behind, kChaosWidth, kChaosHeight, chaos_config()),
        known(kChaosWidth, kChaosHeight, chaos_config()) {
    std::vector<ConstantMemory> memory;
    both.first().list_constants(memory);
    for (const ConstantMemory& block : memory) {
      const bool is_launch =
          std::strcmp(block.what, "launch list") == 0 || std::strcmp(block.what, "kernel parameters") == 0;
      (is_launch ? launches : tables).push_back(block);
    }
    scrub.add(tables, 0);
    scrub.add(launches, 0);
    const std::clock_t began = std::clock();
    both.detect(known.image());
    patience = kHangFactor * (std::clock() - began) + CLOCKS_PER_SEC / 50;
    for (ChaosScene& picture : chaos_scenes(kScenes)) scenes.push_back(prepared(std::move(picture), behind));
  }

  /// The scene's result without a fault, and what memory it uses.
  Scene prepared(ChaosScene picture, Backend& backend) const {
    Scene scene;
    Detector detector(backend, kChaosWidth, kChaosHeight, chaos_config());
    const FrameResult& result = detector.detect(picture.image.view());
    scene.digest = digest_of(result);
    scene.status = result.status;
    MarkerPlan plan(backend, kChaosWidth, kChaosHeight, chaos_config());
    const std::unique_ptr<Stream> stream = backend.make_stream();
    pad_frame(picture.image.view(), plan.geometry(), static_cast<u8*>(plan.frame().host()));
    stream->replay(plan.plan());
    stream->finish();
    StageReader reader(plan, *stream);
    const std::vector<StepTraffic> traffic = step_traffic(reader);
    scene.pixels.push_back({0, 0, plan.frame().bytes() / 4});
    for (std::size_t s = 0; s < traffic.size(); ++s) {
      for (std::size_t a = 0; a < traffic[s].arguments.size(); ++a) {
        if (args_of(traffic[s].op)[a].read_only) continue;
        const ArgumentTraffic& written = traffic[s].arguments[a];
        // A frame without any of a list has written its header or its first words all the same.
        const Target target{static_cast<int>(s), static_cast<int>(a), std::max<std::size_t>(written.bytes / 4, 1)};
        (is_result(plan, written.buffer, traffic[s].op) ? scene.results : scene.intermediate).push_back(target);
      }
    }
    scene.picture = std::move(picture);
    return scene;
  }

  /// Whether the host reads what this operation has written: contours do change once more after they are collected.
  static bool is_result(const MarkerPlan& plan, const Buffer* buffer, Op op) {
    if (op != Op::quad_fit && op != Op::edge_refine && op != Op::contour_collect) return false;
    return std::any_of(plan.searches().begin(), plan.searches().end(), [&](const MarkerSearch& search) {
      return buffer == search.contours || buffer == search.quads || buffer == search.edges;
    });
  }

  /// In the child: the frame with its flip, and who noticed.
  int run(ChaosRegion region, Dice& dice) {
    Scene& scene = scenes[dice.below(scenes.size())];
    const View2D<u8> image = scene.picture.image.view();
    test::Fault fault;
    const auto in_step = [&](const std::vector<Target>& targets, bool before) {
      const Target& target = targets[dice.below(targets.size())];
      fault.flip_step = target.step;
      fault.flip_before = before;
      fault.flip_argument = target.argument;
      fault.flip_word = dice.below(target.words);
      fault.flip_bit = static_cast<int>(dice.below(32));
    };
    const auto turn = [&](unsigned char* bytes, std::size_t count) {
      flipped = bytes + dice.below(count);
      flipped_bit = static_cast<unsigned char>(1u << dice.below(8));
      *flipped ^= flipped_bit;
    };
    // Nobody writes there: that is what is tried.
    const auto in_block = [&](const ConstantMemory& memory) {
      turn(static_cast<unsigned char*>(const_cast<void*>(memory.data)), memory.bytes);
    };
    flipped_bit = 0;
    switch (region) {
      case ChaosRegion::image:
        turn(image.data, std::size_t{kChaosWidth} * kChaosHeight);
        break;
      case ChaosRegion::pixels:
        in_step(scene.pixels, true);
        break;
      case ChaosRegion::intermediate:
        in_step(scene.intermediate, false);
        break;
      case ChaosRegion::results:
        in_step(scene.results, false);
        break;
      case ChaosRegion::tables:
        in_block(choose(tables, dice));
        break;
      case ChaosRegion::launches:
        in_block(choose(launches, dice));
        break;
    }
    faulty.arm(fault);
    const FrameResult& result = both.detect(image);
    int said = kSaid;
    if (both.difference()) said |= kLockstep;
    if (digest_of(result) == scene.digest) return said;
    said |= kChanged;
    if (result.status != scene.status && result.status != FrameStatus::no_target && result.status != FrameStatus::ok) {
      said |= kStatus;
    }
    if (has_wrong_pose(scene.picture, result)) said |= kWrongPose;
    if (scrub.check(scrub.bytes())) said |= kScrub;
    if (!known.fits(both.detect(known.image()))) said |= kKnownAnswer;
    return said;
  }

  /// Whether the next frame shows any of the flip before it.
  bool leaves_trace() {
    faulty.arm({});
    return !known.fits(both.detect(known.image())) || both.difference();
  }

  /// In the child: flips from number `index` on, one byte each to `pipe`, until one has left a trace or there are
  /// `most`.
  [[noreturn]] void run_some(u64 seed, u64 index, u64 most, int pipe) {
    const rlimit no_core = {0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    // Either ends the process by its signal.
    const itimerval limit = {{0, 0}, {patience / CLOCKS_PER_SEC, patience % CLOCKS_PER_SEC * 1000000 / CLOCKS_PER_SEC}};
    if (freopen("/dev/null", "w", stderr) == nullptr) _exit(1);  // sanitizers say at length what is wanted here
    for (; index < most; ++index) {
      setitimer(ITIMER_PROF, &limit, nullptr);
      alarm(kHangSeconds);
      Dice dice(seed, index);
      const ChaosRegion region = region_of(index);
      const int said = run(region, dice);
      const auto byte = static_cast<unsigned char>(said);
      if (write(pipe, &byte, 1) != 1) _exit(1);
      // An address that was altered may have had something written that no comparison looks at.
      if ((said & kChanged) != 0 || region == ChaosRegion::launches) break;
      *flipped ^= flipped_bit;
      if ((said & kLockstep) != 0 && leaves_trace()) break;
    }
    _exit(kSaid);
  }

  /// What a child said of flips from number `index` on; -1 for one that ended it.
  std::vector<int> run_in_child(u64 seed, u64 index, u64 most) {
    int ends[2];
    if (pipe(ends) != 0) throw Error(std::string("a pipe cannot be made: ") + std::strerror(errno));
    const pid_t child = fork();
    if (child < 0) throw Error(std::string("a child process cannot be started: ") + std::strerror(errno));
    if (child == 0) run_some(seed, index, most, ends[1]);
    close(ends[1]);
    std::vector<int> said;
    unsigned char byte = 0;
    for (ssize_t count = 1; count > 0 || (count < 0 && errno == EINTR);) {
      count = read(ends[0], &byte, 1);
      if (count == 1) said.push_back(byte);
    }
    close(ends[0]);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (!WIFEXITED(status) || WEXITSTATUS(status) != kSaid) said.push_back(-1);
    return said;
  }

  test::FaultyBackend faulty;
  Lockstep both;
  KnownAnswer known;
  MemoryScrub scrub;
  std::clock_t patience = 0;
  /// The bit that was turned over in memory that stays; none where the mask is 0.
  unsigned char* flipped = &flipped_bit;
  unsigned char flipped_bit = 0;
  std::vector<ConstantMemory> tables, launches;
  std::vector<Scene> scenes;
};

ChaosCampaign::ChaosCampaign(Backend& backend) {
  if (backend.make_buffer(4)->host() == nullptr || !backend.make_stream()->is_immediate()) {
    throw Error(std::string(backend.name()) +
                ": its driver does not survive in a child process, in which each flip is tried; use simd, cpu or "
                "reference");
  }
  impl_ = std::make_unique<Impl>(backend);
}
ChaosCampaign::~ChaosCampaign() = default;

void ChaosCampaign::next(ChaosReport& report, u64 most) {
  for (const int said : impl_->run_in_child(report.seed, report.flips, most)) {
    if (report.flips < most) count(said, report.regions[static_cast<std::size_t>(region_of(report.flips++))]);
  }
}

}  // namespace berth
