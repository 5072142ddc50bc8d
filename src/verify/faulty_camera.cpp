#include "verify/faulty_camera.hpp"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <thread>
#include <utility>

#include "berth/error.hpp"
#include "monotonic.hpp"

namespace berth {
namespace {

/// Frames without a fault after one, so that each is counted by itself.
constexpr u64 kQuiet = 6;
/// As many before the first.
constexpr u64 kFirst = 2;
// An hour: a film that is not in real time falls behind the arrivals' clock on a busy machine, and a time that is less
// ahead than that is one that can be.
constexpr std::int64_t kAheadNs = 3'600'000'000'000, kSetBackNs = 5'000'000'000, kStartNs = 100'000'000'000;

}  // namespace

const char* name_of(CameraFault fault) {
  constexpr std::array<const char*, kCameraFaults> kNames = {"none",    "dropped", "doubled", "torn",     "half",
                                                             "frozen",  "back",    "ahead",   "set back", "gone",
                                                             "resized", "black",   "white"};
  return kNames[static_cast<std::size_t>(fault)];
}

const char* fate_of(CameraFault fault) {
  switch (fault) {
    case CameraFault::dropped:
      return "counted as lost";
    case CameraFault::doubled:
    case CameraFault::frozen:
      return "counted as repeated, not handed on";
    case CameraFault::half:
      return "counted as incomplete, not handed on";
    case CameraFault::back:
    case CameraFault::ahead:
      return "counted as misdated, not handed on";
    case CameraFault::set_back:
      return "two frames counted as misdated, then the new times hold";
    case CameraFault::gone:
    case CameraFault::resized:
      return "complained of, opened again";
    case CameraFault::torn:
      return "handed on; no wrong pose";
    case CameraFault::black:
    case CameraFault::white:
      return "handed on; no marker";
    case CameraFault::none:
      break;
  }
  return "";
}

struct FaultyFilm::Impl {
  class Camera;

  Impl(std::vector<GrayImage> all, const FaultyFilmOptions& wanted)
      : options(wanted), pictures(std::move(all)), random(sim::scatter(wanted.seed)) {
    assert(pictures.size() >= 2);
    period_ns = static_cast<std::int64_t>(1e9 / options.frames_per_second);
    start_ns = options.in_real_time ? monotonic_ns() : kStartNs;
  }

  std::size_t picture_of(u64 number) const {
    const u64 last = pictures.size() - 1, at = number % (2 * last);
    return static_cast<std::size_t>(at <= last ? at : 2 * last - at);
  }
  std::int64_t time_of(u64 number) const {
    return start_ns + static_cast<std::int64_t>(number) * period_ns - clock * kSetBackNs;
  }

  CameraFault draw_fault() {
    if (is_begun) {
      is_begun = false;
      return CameraFault::none;
    }
    CameraFault fault = CameraFault::none;
    if (!options.kinds.empty() && next < options.frames && next >= quiet_until && random.chance(options.share)) {
      const int kind = random.integer(0, static_cast<int>(options.kinds.size()) - 1);
      fault = options.kinds[static_cast<std::size_t>(kind)];
      quiet_until = next + kQuiet;
    }
    ++begun[static_cast<std::size_t>(fault)];
    return fault;
  }

  void film_next(CameraFault fault) {
    filmed.number = filmed.noise = next;
    filmed.fault = fault;
    filmed.picture = filmed.below = picture_of(next);
    filmed.clock = clock;
    filmed.time_ns = time_of(next);
    ++next;
    ++sequence;
  }

  const FaultyFilmOptions options;
  const std::vector<GrayImage> pictures;
  sim::Random random;
  std::int64_t period_ns = 0, start_ns = 0;
  u64 next = 0;              // frame to come
  u64 quiet_until = kFirst;  // no fault before
  std::uint32_t sequence = 0;
  int clock = 0;           // times that it was set back
  int away = 0;            // attempts to open it in vain to come
  bool is_small = false;   // opened next, it has the other size
  bool is_begun = false;   // the fault that the next frame would have
  bool again = false;      // the last frame once more
  int frozen = 0;          // frames to come with the last one's picture
  FilmedFrame filmed;      // taken last
  bool is_broken = false;  // reading it will find out
  FilmedFrame read;        // whole
  std::array<u64, kCameraFaults> begun = {};
  SourceHealth expected;
};

class FaultyFilm::Impl::Camera final : public LiveCamera {
 public:
  explicit Camera(const FaultyFilm& film) : film_(film), it_(*film.impl_), is_small_(it_.is_small) {
    it_.is_small = false;
  }

  int take(int, Filled& filled) override {
    filled = Filled();
    filled.clock = it_.options.in_real_time ? "monotonic" : "simulation";
    it_.is_broken = false;
    if (it_.again) {
      it_.again = false;
      ++it_.expected.repeated;
    } else if (is_small_) {
      if (has_given_) return ENODEV;
      it_.film_next(CameraFault::resized);
    } else if (it_.frozen > 0) {
      --it_.frozen;
      ++it_.expected.repeated;
      const FilmedFrame held = it_.filmed;
      it_.film_next(CameraFault::frozen);
      it_.filmed.picture = it_.filmed.below = held.picture;
      it_.filmed.noise = held.noise;
    } else if (!film(it_.draw_fault(), filled)) {
      return ENODEV;
    }
    has_given_ = true;
    wait_until_due();
    filled.sequence = it_.sequence;
    filled.time_ns = it_.filmed.time_ns;
    return 0;
  }

  int give_back(const Filled&) override { return 0; }

  bool read(const Filled&, View2D<u8> image) const override {
    if (it_.is_broken) return false;
    it_.read = it_.filmed;
    film_.draw(it_.filmed, image);
    return true;
  }

  int width() const override { return it_.pictures.front().width() / (is_small_ ? 2 : 1); }
  int height() const override { return it_.pictures.front().height() / (is_small_ ? 2 : 1); }
  std::int64_t exposure_ns() const override { return 0; }

 private:
  /// False: the camera is gone.
  bool film(CameraFault fault, Filled& filled) {
    if (fault == CameraFault::gone || fault == CameraFault::resized) {
      it_.is_small = fault == CameraFault::resized;
      it_.away = it_.is_small ? 0 : it_.random.integer(1, 2);
      it_.expected.reopened += it_.is_small ? 2 : 1;
      it_.is_begun = true;
      return false;
    }
    if (fault == CameraFault::dropped) {
      const int lost = it_.random.integer(1, 3);
      it_.next += static_cast<u64>(lost);
      it_.sequence += static_cast<std::uint32_t>(lost);
      it_.expected.lost += static_cast<u64>(lost);
    } else if (fault == CameraFault::set_back) {
      ++it_.clock;
      it_.expected.misdated += 2;
    }
    it_.film_next(fault);
    alter(fault, filled);
    return true;
  }

  void alter(CameraFault fault, Filled& filled) {
    FilmedFrame& frame = it_.filmed;
    const int height = it_.pictures.front().height();
    switch (fault) {
      case CameraFault::doubled:
        it_.again = true;
        break;
      case CameraFault::torn:
        frame.below = it_.picture_of(frame.number - 1);
        frame.seam = it_.random.integer(height / 8, height * 7 / 8);
        break;
      case CameraFault::half:
        it_.is_broken = it_.random.chance(0.5);
        filled.damaged = !it_.is_broken;
        ++it_.expected.incomplete;
        break;
      case CameraFault::frozen:
        it_.frozen = it_.random.integer(2, 6);
        break;
      case CameraFault::back:
        frame.time_ns -= it_.period_ns + it_.random.integer(1, 2000) * std::int64_t{1'000'000};
        ++it_.expected.misdated;
        break;
      case CameraFault::ahead:
        frame.time_ns += kAheadNs;
        ++it_.expected.misdated;
        break;
      default:
        break;
    }
  }

  void wait_until_due() const {
    if (!it_.options.in_real_time) return;
    const std::int64_t wait_ns = it_.time_of(it_.filmed.number) - monotonic_ns();
    if (wait_ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(wait_ns));
  }

  const FaultyFilm& film_;
  Impl& it_;
  const bool is_small_;
  bool has_given_ = false;
};

FaultyFilm::FaultyFilm(std::vector<GrayImage> pictures, const FaultyFilmOptions& options)
    : impl_(std::make_unique<Impl>(std::move(pictures), options)) {}
FaultyFilm::~FaultyFilm() = default;

LiveCameraOpener FaultyFilm::opener() {
  return [this]() -> std::unique_ptr<LiveCamera> {
    if (impl_->away > 0) {
      --impl_->away;
      throw Error("film: the camera cannot be opened; plug it in");
    }
    return std::make_unique<Impl::Camera>(*this);
  };
}

const FilmedFrame& FaultyFilm::last() const { return impl_->read; }
const std::array<u64, kCameraFaults>& FaultyFilm::begun() const { return impl_->begun; }
const SourceHealth& FaultyFilm::expected() const { return impl_->expected; }

void FaultyFilm::draw(const FilmedFrame& frame, View2D<u8> image) const {
  const bool is_flat = frame.fault == CameraFault::black || frame.fault == CameraFault::white;
  for (int y = 0; y < image.height; ++y) {
    u8* const row = image.row(y);
    const bool is_below = frame.fault == CameraFault::torn && y >= frame.seam;
    if (is_flat) {
      std::fill_n(row, image.width, static_cast<u8>(frame.fault == CameraFault::white ? 255 : 0));
    } else {
      std::copy_n(impl_->pictures[is_below ? frame.below : frame.picture].view().row(y), image.width, row);
    }
  }
  if (is_flat) return;
  // No sensor gives a picture twice: the lowest bits of some pixels are the frame's own.
  const u64 bits = sim::scatter(frame.noise);
  for (int x = 0; x < std::min(64, image.width); ++x) image.at(x, 0) ^= static_cast<u8>(bits >> x & 1);
}

}  // namespace berth
