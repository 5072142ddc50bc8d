#include "flight_play.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>

#include "berth/error.hpp"
#include "berth/pilot_stream.hpp"
#include "camera/bad_input.hpp"
#include "health_show.hpp"
#include "pipeline_show.hpp"

namespace berth::cli {
namespace {

constexpr std::size_t kMostInMemory = 2'000'000'000;

std::vector<navset::FlightFrame> draw(const navset::Flight& flight, Console& console) {
  std::vector<navset::FlightFrame> frames;
  const CameraModel camera = navset::Flight::camera();
  const std::size_t bytes = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  if (static_cast<std::size_t>(flight.frames()) * bytes > kMostInMemory) {
    throw bad_field("command line", "--frames", std::to_string(flight.frames()),
                    "played frames lie in memory, at most 2 GB of them");
  }
  for (int i = 0; i < flight.frames(); ++i) {
    frames.push_back(flight.frame(i));
    if (console.out_is_terminal()) {
      console.out() << fmt::format("\rdrawing     frame {} of {}\x1b[K", i + 1, flight.frames()) << std::flush;
    }
  }
  if (console.out_is_terminal()) console.out() << "\r\x1b[K";
  return frames;
}

/// What is kept of a frame when its slot is given back.
struct Landed {
  PilotFrame pilot;
  std::optional<Detection> marker;
  Sighting sighting;
};

/// From the pipeline's thread to the one that shows: room for all frames is taken before the first.
class Landings {
 public:
  explicit Landings(std::size_t frames) { all_.reserve(frames); }

  void add(const PilotFrame& pilot) {
    Landed landed{pilot, std::nullopt, {}};
    if (pilot.marker != nullptr) landed.marker = *pilot.marker;
    if (pilot.looked_for_target) landed.sighting = *pilot.sighting;
    const std::lock_guard<std::mutex> lock(mutex_);
    all_.push_back(landed);
    moved_.notify_all();
  }
  void end() {
    const std::lock_guard<std::mutex> lock(mutex_);
    has_ended_ = true;
    moved_.notify_all();
  }
  /// The k-th, waiting for it; null after the last.
  const Landed* at(std::size_t k) {
    std::unique_lock<std::mutex> lock(mutex_);
    moved_.wait(lock, [&] { return has_ended_ || k < all_.size(); });
    if (k == all_.size()) return nullptr;
    Landed& landed = all_[k];  // stays where it is
    landed.pilot.markers = nullptr;
    landed.pilot.marker = landed.marker ? &*landed.marker : nullptr;
    landed.pilot.sighting = landed.pilot.looked_for_target ? &landed.sighting : nullptr;
    return &landed;
  }

 private:
  std::mutex mutex_;
  std::condition_variable moved_;
  std::vector<Landed> all_;
  bool has_ended_ = false;
};

Json to_json(const PilotStreamCounts::Beside& counts, const std::vector<double>& deadlines_ms) {
  Json json = {{"frames", counts.frames}};
  for (std::size_t i = 0; i < deadlines_ms.size(); ++i) {
    json["late"].push_back({{"deadline_ms", deadlines_ms[i]}, {"frames", counts.late[i]}});
  }
  return json;
}

void describe(const NavigationChoice& choice, const NavigationOptions& options, double fps, std::ostream& out) {
  out << fmt::format("network     on {}, its word counts {} frame{} ({:.0f} ms) after the one it is given\n",
                     choice.backend, choice.frames, choice.frames == 1 ? "" : "s", 1000 * choice.frames / fps);
  if (choice.look_ms.empty()) return;
  out << (choice.is_measured ? "measured   " : "on record  ");
  for (const auto& [name, ms] : choice.look_ms) out << fmt::format(" {} {:.0f} ms", name, ms);
  out << " for its slowest look; ";
  if (!options.record.empty()) {
    out << (choice.is_measured ? "written to " : "from ") << options.record << '\n';
  } else {
    out << fmt::format("the same again by --nav-backend {} --nav-frames {}\n", choice.backend, choice.frames);
  }
}

}  // namespace

PlayedFlight play_flight(const navset::Flight& flight, const FlightOptions& options, Console& console,
                         const FlightWatcher& seen) {
  PilotConfig pilot = flight_pilot(flight_network(options));
  PilotStreamConfig config;
  config.pipeline = make_pipeline_config(options.pace, pilot.detector);
  if (options.known_answer_s > 0) {
    config.pipeline.health.emplace().known_answer_every_ns = std::llround(options.known_answer_s * 1e9);
    pilot.navigator.health = config.pipeline.health;
  }
  config.pilot = pilot;
  const EngineBackends docking = open_chosen_backends(options.engine);
  std::vector<Backend*> chain;
  for (const auto& backend : docking.backends) chain.push_back(backend.get());
  const std::vector<navset::FlightFrame> frames = draw(flight, console);
  const View2D<const u8> first = frames.front().image.view();
  const NavigationChoice choice = choose_navigation(options.navigation, options.engine, docking.backends[0]->name(),
                                                    pilot.navigator, first, options.pace.fps);
  describe(choice, options.navigation, options.pace.fps, console.out());
  const std::unique_ptr<Backend> navigation = open_for_navigation(choice.backend, options.engine);
  config.network_frames = choice.frames;

  Landings landings(frames.size());
  std::exception_ptr error;
  PilotStream stream(chain, *navigation, first.width, first.height, config,
                     [&](const PilotStreamFrame& frame) { landings.add(*frame.pilot); });
  PacedCamera camera(options.pace.fps, frames.size(), options.pace.realtime);
  stream.start();
  camera.start([&](std::uint64_t i, const FrameStamp& stamp) { return stream.push(frames[i].image.view(), stamp); },
               [&] {
                 try {
                   stream.stop();
                 } catch (...) {
                   error = std::current_exception();
                 }
                 landings.end();
               });
  PlayedFlight played{{options.seed, flight.title(), {}}, {}};
  for (std::size_t k = 0; const Landed* landed = landings.at(k); ++k) {
    const PilotFrame& found = landed->pilot;
    // A position by the network is one of the frame that it was given.
    const bool is_of_network = found.has_position && !found.from_marker;
    const u64 of = is_of_network ? found.sighting->stamp.sequence : found.stamp.sequence;
    const navset::FlightFrame& truth = frames[of];
    played.log.points.push_back(flight_point(static_cast<int>(found.stamp.sequence), truth, found));
    seen(played.log.points.back(), truth, found);
  }
  camera.join();
  if (error) std::rethrow_exception(error);

  const PilotStreamCounts counts = stream.counts();
  std::ostream& out = console.out();
  print_counts(out, stream.pipeline().counts());
  out << fmt::format("; the camera's thread was late for {}\n", camera.late());
  print_laps(out, stream.pipeline());
  out << "the network at work:  ";
  print_late(out, options.pace.deadlines_ms, counts.beside_network.late, counts.beside_network.frames);
  out << "the network at rest:  ";
  print_late(out, options.pace.deadlines_ms, counts.alone.late, counts.alone.frames);
  out << fmt::format("{} looks of the network, {} of them late", counts.looks, counts.late_looks);
  const HealthReport network = stream.network_health();
  if (counts.lost_looks > 0)
    out << "; it was left: " << (*network.reason == '\0' ? "its device was lost" : network.reason);
  out << '\n';
  print_health(out, stream.pipeline().health());
  if (network.known_answers > 0) {
    out << "the network's ";
    print_health(out, network);
  }
  played.counts = to_json(stream.pipeline(), options.pace.deadlines_ms);
  played.counts["fps"] = options.pace.fps;
  played.counts["network"] = {{"backend", choice.backend},
                              {"frames", choice.frames},
                              {"looks", counts.looks},
                              {"late_looks", counts.late_looks},
                              {"at_work", to_json(counts.beside_network, options.pace.deadlines_ms)},
                              {"at_rest", to_json(counts.alone, options.pace.deadlines_ms)}};
  return played;
}

}  // namespace berth::cli
