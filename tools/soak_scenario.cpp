#include "soak_scenario.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "berth/bundle.hpp"
#include "output_file.hpp"
#include "sim/random.hpp"

namespace berth::cli {
namespace {

/// Families without a false marker in the frames of docs/reliability.md, ArUco's by their bits alone: anything found
/// that is not there is a violation.
constexpr std::array<const char*, 6> kFamilies = {"tag36h11", "tagStandard41h12", "tagStandard52h13",
                                                  "tag25h9",  "aruco5x5_100",     "aruco6x6_250"};
constexpr const char* kFisheyeFile = "fisheye.yaml";

template <class T, std::size_t N>
const T& one_of(const std::array<T, N>& all, sim::Random& random) {
  return all[static_cast<std::size_t>(random.integer(0, static_cast<int>(N) - 1))];
}

void draw_view(SoakScenario& s, sim::Random& random) {
  constexpr std::array<std::array<int, 2>, 4> kSizes = {{{320, 240}, {320, 240}, {400, 300}, {640, 480}}};
  const std::array<int, 2> size = one_of(kSizes, random);
  s.width = size[0];
  s.height = size[1];
  s.lens = one_of(std::array<const char*, 4>{"paper", "paper", "ideal", "fisheye"}, random);
  s.family = one_of(kFamilies, random);
  s.size_m = random.uniform(0.05, 0.12);
  const int markers = random.chance(0.5) ? 1 : random.integer(2, 4);
  const auto codes = static_cast<int>(family(s.family).codes.size());
  const double off = 0.8 * s.size_m;
  const std::array<std::array<double, 2>, 4> places = {{{-off, -off}, {off, off}, {off, -off}, {-off, off}}};
  while (static_cast<int>(s.markers.size()) < markers) {
    const int id = random.integer(0, codes - 1);
    const auto is_it = [&](const SoakMarker& m) { return m.id == id; };
    if (std::any_of(s.markers.begin(), s.markers.end(), is_it)) continue;
    const std::array<double, 2>& place = places[s.markers.size()];
    s.markers.push_back(markers == 1 ? SoakMarker{id, 0, 0} : SoakMarker{id, place[0], place[1]});
  }
  s.pictures = random.integer(6, 12);
  s.frames_per_second = random.uniform(30, 120);
}

/// A short piece of an approach, no faster than some 1 % of the range a frame.
void draw_scene(SoakScenario& s, sim::Random& random) {
  const double fx = 1338.84 * s.width / 1280;
  const double side_px = random.uniform(42, s.markers.size() == 1 ? 0.45 * s.height : 0.25 * s.height);
  const double range = fx * s.size_m / side_px;
  const double closer = 1 - 0.01 * random.uniform(0.1, 1) * (s.pictures - 1);
  const double spread = s.markers.size() == 1 ? 0.2 : 0.08;
  std::string text = fmt::format("seed = {}\n[camera]\n", random.integer(1, 1'000'000'000));
  if (s.lens == "fisheye") {
    text += fmt::format("file = \"{}\"\n", kFisheyeFile);
  } else {
    text += fmt::format("width = {}\nheight = {}\n", s.width, s.height);
    if (s.lens == "ideal") text += "distortion = [0, 0, 0, 0, 0]\n";
  }
  text += fmt::format("frame_rate_hz = {:.3f}\nexposure_ms = {:.3f}\n", s.frames_per_second, random.uniform(0.5, 3));
  const double x = random.uniform(-spread, spread) * range;
  const double y = random.uniform(-spread, spread) * range;
  const double dx = random.uniform(-0.002, 0.002) * range * s.pictures;
  const double dy = random.uniform(-0.002, 0.002) * range * s.pictures;
  text += fmt::format(
      "[trajectory]\nframes = {}\nfrom_range_m = {:.6f}\nto_range_m = {:.6f}\nfrom_offset_m = [{:.6f}, {:.6f}]\n"
      "to_offset_m = [{:.6f}, {:.6f}]\n",
      s.pictures, range, range * closer, x, y, x + dx, y + dy);
  std::array<double, 6> turns = {};
  for (std::size_t i = 0; i < 3; ++i) {
    turns[i] = random.uniform(-25, 25);
    turns[i + 3] = turns[i] + random.uniform(-0.2, 0.2) * s.pictures;
  }
  text += fmt::format("from_rotation_deg = [{:.4f}, {:.4f}, {:.4f}]\nto_rotation_deg = [{:.4f}, {:.4f}, {:.4f}]\n",
                      turns[0], turns[1], turns[2], turns[3], turns[4], turns[5]);
  for (const SoakMarker& marker : s.markers) {
    text += fmt::format(
        "[[marker]]\nfamily = \"{}\"\nid = {}\nsize_m = {:.9f}\nposition_m = [{:.9f}, {:.9f}, 0]\n"
        "margin_modules = 1\n",
        s.family, marker.id, s.size_m, marker.x_m, marker.y_m);
  }
  const bool has_body = random.chance(0.7);
  text += fmt::format("[target]\nbody = {}\nwings = {}\nring = {}\n", has_body, has_body, has_body);
  text += fmt::format("[background]\nitems = {}\n", random.integer(0, 120));
  const double ambient = random.uniform(0.2, 0.6);
  text += fmt::format("[lighting]\nambient = {:.3f}\ndirect = {:.3f}\n", ambient, 1 - ambient);
  if (random.chance(0.2)) {
    const double angle = random.uniform(-180, 180);
    const double offset = random.uniform(-0.1, 0.1);
    text += fmt::format("[[lighting.shadow]]\nangle_deg = {:.1f}\noffset = {:.3f}\ndepth = {:.2f}\n", angle, offset,
                        random.uniform(0.3, 0.7));
  }
  if (random.chance(0.2)) {
    const double at = random.uniform(-0.3, 0.3);
    text += fmt::format("[[lighting.glare]]\ncenter = [{:.3f}, {:.3f}]\nstrength = 0.2\n", at, -at);
  }
  text += fmt::format("[sensor]\nblur_fineness = 4\nblur_sigma_px = {:.3f}\n", random.uniform(0.5, 1));
  text += fmt::format("white_level = {:.1f}\n", random.uniform(120, 245));
  text += fmt::format("read_noise = {:.2f}\n", random.uniform(0.5, 3));
  s.toml = std::move(text);
}

void draw_engine(SoakScenario& s, sim::Random& random, const std::vector<std::string>& backends) {
  s.in_real_time = random.chance(0.35);
  s.frames = static_cast<u64>(random.integer(60, 180));
  s.track = random.chance(0.5);
  s.filter = random.chance(0.5);
  s.bundle = s.markers.size() > 1 && random.chance(0.6);
  s.digests = !s.in_real_time && random.chance(0.2);
  s.corners = random.chance(0.3) ? "photometric" : "edges";
  s.pose = random.chance(0.1) ? "paper" : "least-squares";
  // The quick ones most often; the others take tens of milliseconds a frame.
  const auto draw = [&] {
    if (random.chance(0.75)) return std::string(random.chance(0.7) ? "simd" : "cpu");
    return backends[static_cast<std::size_t>(random.integer(0, static_cast<int>(backends.size()) - 1))];
  };
  s.backend = draw();
  s.second = s.backend == "simd" ? "cpu" : "simd";
  if (random.chance(0.3)) s.second = draw();
  const bool is_quick = s.backend == "simd" || s.backend == "cpu";
  s.lockstep = !s.in_real_time && random.chance(0.2);
  s.known_answers = !s.lockstep && random.chance(0.3);
  if (!s.lockstep && is_quick && random.chance(0.35)) {
    s.backend_fault = random.chance(0.6) ? BackendFault::lost : BackendFault::stalled;
    // Who hangs is told by the pipeline alone.
    if (s.in_real_time && random.chance(0.4)) s.backend_fault = BackendFault::hung;
    s.backend_fault_frame = random.integer(2, static_cast<int>(s.frames) - 10);
    s.fail_back = s.loses_backend() && random.chance(0.6);
    // A backend is believed again by its known answers.
    s.known_answers = s.known_answers || s.fail_back;
  }
  if (!is_quick || (s.second != "simd" && s.second != "cpu")) s.frames = std::min<u64>(s.frames, 60);
}

void draw_faults(SoakScenario& s, sim::Random& random) {
  s.record = random.chance(0.35);
  if (s.record) {
    s.recorded = random.chance(0.8) ? RecordPictures::raw : RecordPictures::png;
    // In real time there is a log, which has to find room.
    if (random.chance(0.35)) {
      s.disk_bytes = static_cast<u64>(random.integer(s.in_real_time ? 1'500'000 : 60'000, 3'000'000));
    }
  }
  if (s.in_real_time && random.chance(0.5)) {
    for (int i = random.integer(1, 3); i > 0; --i) {
      s.starved.push_back(static_cast<u64>(random.integer(5, static_cast<int>(s.frames) - 5)));
    }
    std::sort(s.starved.begin(), s.starved.end());
  }
  s.film.seed = random.bits();
  s.film.frames = s.frames;
  s.film.frames_per_second = s.frames_per_second;
  s.film.in_real_time = s.in_real_time;
  s.film.share = random.chance(0.15) ? 0 : random.uniform(0.05, 0.5);
  for (std::size_t i = 1; i < kCameraFaults; ++i) {
    const auto fault = static_cast<CameraFault>(i);
    // The monotonic clock is not set.
    if (s.in_real_time && fault == CameraFault::set_back) continue;
    // Rare ones: opening a camera again takes 50 ms and more.
    const bool is_slow = fault == CameraFault::gone || fault == CameraFault::resized;
    if (random.chance(is_slow ? 0.3 : 0.7)) s.film.kinds.push_back(fault);
  }
}

}  // namespace

// One number a statement, here and above: compilers evaluate the arguments of a call in different orders.
SoakScenario draw_scenario(u64 seed, u64 number, const std::vector<std::string>& backends) {
  SoakScenario scenario;
  scenario.seed = seed;
  scenario.number = number;
  sim::Random random(sim::scatter(seed) ^ sim::scatter(number + 1));
  draw_view(scenario, random);
  draw_scene(scenario, random);
  draw_engine(scenario, random, backends);
  draw_faults(scenario, random);
  return scenario;
}

std::string SoakScenario::describe() const {
  std::string text = fmt::format("{}x{} {}, {} {} of {:.0f} mm, {} on {}", width, height, lens, markers.size(), family,
                                 size_m * 1000, corners, backend);
  const auto add = [&](bool is_so, const std::string& word) {
    if (is_so) text += ", " + word;
  };
  add(lockstep, "in lockstep with " + second);
  add(pose == "paper", "the paper's pose");
  add(in_real_time, fmt::format("at {:.0f} frames/s", frames_per_second));
  add(track, "tracked");
  add(filter, "filtered");
  add(bundle, "a bundle");
  add(digests, "digests");
  add(known_answers, "known answers");
  add(backend_fault == BackendFault::lost, "its device lost");
  add(backend_fault == BackendFault::hung, "its device hung");
  add(backend_fault == BackendFault::stalled, "its device stalled");
  add(fail_back, "gone back to");
  add(record, disk_bytes > 0 ? fmt::format("recorded, disk full after {} kB", disk_bytes / 1000) : "recorded");
  add(!starved.empty(), "threads starved");
  return text;
}

std::string write_scenario(const SoakScenario& s, const std::string& folder) {
  if (s.lens == "fisheye") {
    const double fx = 1338.84 * s.width / 1280;
    write_file(
        folder + "/" + kFisheyeFile, "the camera",
        fmt::format("image_width: {}\nimage_height: {}\ncamera_name: fisheye\ncamera_matrix:\n  rows: 3\n  cols: "
                    "3\n  data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]\ndistortion_model: equidistant\n"
                    "distortion_coefficients:\n  rows: 1\n  cols: 4\n  data: [-0.02, 0.01, 0, 0]\n",
                    s.width, s.height, fx, s.width * 0.49, fx, s.height * 0.51));
  }
  std::string file = folder + "/scenario.toml";
  write_file(file, "the scenario", s.toml);
  return file;
}

std::string write_bundle_of(const SoakScenario& s, const std::string& folder) {
  Bundle bundle;
  bundle.name = "body";
  for (const SoakMarker& marker : s.markers) {
    BundleMarker place;
    place.family = &family(s.family);
    place.id = marker.id;
    place.size_m = s.size_m;
    place.pose.t = {marker.x_m, marker.y_m, 0};
    bundle.markers.push_back(place);
  }
  std::string file = folder + "/bundle.yaml";
  write_bundle(file, bundle);
  return file;
}

}  // namespace berth::cli
