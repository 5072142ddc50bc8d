#include "sim/paint.hpp"

#include <algorithm>
#include <cmath>

#include "sim/edges.hpp"
#include "sim/layer.hpp"
#include "sim/random.hpp"
#include "sim/tiles.hpp"

namespace berth::sim {
namespace {

// A pixel's rays: center + a·du + b·dv, a and b in −½ … ½. The lens bends less than 1e-4 px within a pixel.
struct PixelRays {
  Vec2 center, du, dv;
  Vec2 at(double a, double b) const { return {center[0] + a * du[0] + b * dv[0], center[1] + a * du[1] + b * dv[1]}; }
};

PixelRays pixel_rays(const RayMap& rays, int x, int y) {
  const Vec2 &p00 = rays.corner(x, y), &p10 = rays.corner(x + 1, y), &p01 = rays.corner(x, y + 1),
             &p11 = rays.corner(x + 1, y + 1);
  PixelRays pixel;
  for (std::size_t i = 0; i < 2; ++i) {
    pixel.center[i] = ((p00[i] + p10[i]) + (p01[i] + p11[i])) * 0.25;
    pixel.du[i] = ((p10[i] - p00[i]) + (p11[i] - p01[i])) * 0.5;
    pixel.dv[i] = ((p01[i] - p00[i]) + (p11[i] - p10[i])) * 0.5;
  }
  return pixel;
}

// A line over one pixel: value + a·ga + b·gb, ≥ 0 on its inner side.
struct PixelLine {
  double value, ga, gb;
  double reach() const { return 0.5 * (std::abs(ga) + std::abs(gb)); }
};

PixelLine over_pixel(const Vec3& line, const PixelRays& pixel) {
  return {line[0] * pixel.center[0] + line[1] * pixel.center[1] + line[2],
          line[0] * pixel.du[0] + line[1] * pixel.du[1], line[0] * pixel.dv[0] + line[1] * pixel.dv[1]};
}

// Share of the unit square where the line is ≥ 0: exact.
double inner_share(const PixelLine& line) {
  const double a = std::max(std::abs(line.ga), std::abs(line.gb)), b = std::min(std::abs(line.ga), std::abs(line.gb));
  const double d = std::abs(line.value);
  double share = 0;  // of the side that holds the pixel's middle, beyond one half
  if (d >= 0.5 * (a + b)) {
    share = 0.5;
  } else if (d <= 0.5 * (a - b)) {
    share = d / a;
  } else {
    const double rest = 0.5 * (a + b) - d;
    share = 0.5 - rest * rest / (2 * a * b);
  }
  return line.value >= 0 ? 0.5 + share : 0.5 - share;
}

// What one pixel may see at one instant.
class Stack {
 public:
  // Takes the layers of the tile, nearest first, up to one that hides the rest.
  void collect(const std::vector<Layer>& layers, const std::vector<int>& order, const PixelRays& pixel) {
    entries_.clear();
    sides_.clear();
    lines_ = 0;
    fine_ = false;
    for (int i : order) {
      const Layer& layer = layers[static_cast<std::size_t>(i)];
      const std::size_t first = sides_.size();
      bool curved = false;
      const Cover cover = cross_outline(layer, pixel, curved);
      if (cover == Cover::none) {
        sides_.resize(first);
        continue;
      }
      entries_.push_back({&layer, first, sides_.size(), curved});
      lines_ += static_cast<int>(sides_.size() - first) + (curved ? 2 : 0);
      if (sides_.size() > first) line_ = sides_.back();
      if (layer.surface().cells.size() > 1) cross_cells(layer, pixel);
      fine_ = fine_ || layer.surface().fine;
      if (cover == Cover::full) break;
    }
  }
  // Edges in the pixel; two or more stand for "not a single straight one".
  int lines() const { return lines_; }
  // The only one.
  const PixelLine& line() const { return line_; }
  bool fine() const { return fine_; }

  // At a·du + b·dv of the pixel that was collected.
  Seen look(const PixelRays& pixel, double a, double b, double void_albedo) const {
    const Vec2 ray = pixel.at(a, b);
    for (const Entry& entry : entries_) {
      bool inside = true;
      for (std::size_t i = entry.first; i < entry.end && inside; ++i) {
        inside = sides_[i].value + a * sides_[i].ga + b * sides_[i].gb >= 0;
      }
      if (inside && (!entry.curved || entry.layer->hit(ray))) return entry.layer->look(ray);
    }
    return {void_albedo, 0};
  }

 private:
  struct Entry {
    const Layer* layer;
    // Its sides that cross the pixel, in sides_.
    std::size_t first, end;
    bool curved;
  };
  enum class Cover { none, part, full };

  void cross(const PixelLine& line) {
    line_ = line;
    ++lines_;
  }

  Cover cross_outline(const Layer& layer, const PixelRays& pixel, bool& curved) {
    if (!layer.visible() || layer.low()[0] > pixel.center[0] + pixel.du[0] ||
        layer.high()[0] < pixel.center[0] - pixel.du[0]) {
      return Cover::none;
    }
    bool full = true;
    for (int i = 0; i < layer.sides(); ++i) {
      const PixelLine line = over_pixel(layer.side(i), pixel);
      const double reach = line.reach();
      if (line.value <= -reach) return Cover::none;
      if (line.value < reach) {
        full = false;
        sides_.push_back(line);
      }
    }
    if (!layer.disc()) return full ? Cover::full : Cover::part;
    if (!full) {
      curved = true;
      return Cover::part;
    }
    const Vec2 p = layer.plane_point(pixel.center);
    double reach = 0;
    for (const double a : {-0.5, 0.5}) {
      for (const double b : {-0.5, 0.5}) {
        const Vec2 q = layer.plane_point(pixel.at(a, b));
        const double dx = q[0] - p[0], dy = q[1] - p[1];
        reach = std::max(reach, std::sqrt(dx * dx + dy * dy));
      }
    }
    const double radius = std::sqrt(p[0] * p[0] + p[1] * p[1]);
    const Surface& s = layer.surface();
    if (radius - reach > s.outer_radius || radius + reach < s.inner_radius) return Cover::none;
    if (radius + reach < s.outer_radius && (s.inner_radius == 0 || radius - reach > s.inner_radius)) return Cover::full;
    curved = true;
    return Cover::part;
  }

  void cross_cells(const Layer& layer, const PixelRays& pixel) {
    const Surface& s = layer.surface();
    double low_x = 1e300, low_y = 1e300, high_x = -1e300, high_y = -1e300;
    for (const double a : {-0.5, 0.5}) {
      for (const double b : {-0.5, 0.5}) {
        const Vec2 p = layer.plane_point(pixel.at(a, b));
        low_x = std::min(low_x, p[0]);
        high_x = std::max(high_x, p[0]);
        low_y = std::min(low_y, p[1]);
        high_y = std::max(high_y, p[1]);
      }
    }
    const auto clamped = [](double cell, int count) {
      return cell < 0 ? 0 : cell >= count ? count - 1 : static_cast<int>(cell);
    };
    const int c0 = clamped((low_x - s.left) / s.cell_width, s.columns);
    const int c1 = clamped((high_x - s.left) / s.cell_width, s.columns);
    const int r0 = clamped((low_y - s.top) / s.cell_height, s.rows);
    const int r1 = clamped((high_y - s.top) / s.cell_height, s.rows);
    if (c0 == c1 && r0 == r1) return;
    if (c1 > c0 + 1 || r1 > r0 + 1) {
      lines_ += 2;
      return;
    }
    const auto cell = [&](int c, int r) {
      return s.cells[static_cast<std::size_t>(r) * static_cast<std::size_t>(s.columns) + static_cast<std::size_t>(c)];
    };
    const bool rows_equal = cell(c0, r0) == cell(c0, r1) && cell(c1, r0) == cell(c1, r1);
    const bool columns_equal = cell(c0, r0) == cell(c1, r0) && cell(c0, r1) == cell(c1, r1);
    if (rows_equal && columns_equal) return;
    if (rows_equal) {
      cross(over_pixel(layer.line_x(s.left + c1 * s.cell_width), pixel));
    } else if (columns_equal) {
      cross(over_pixel(layer.line_y(s.top + r1 * s.cell_height), pixel));
    } else {
      lines_ += 2;
    }
  }

  std::vector<Entry> entries_;
  std::vector<PixelLine> sides_;
  bool fine_ = false;
  int lines_ = 0;
  PixelLine line_{};
};

// Fibonacci lattices: point i is (i / count, i · step / count mod 1). Every pixel and instant has its own offset.
struct Lattice {
  int count, step;
};
constexpr Lattice kFine = {55, 34};    // where markers are
constexpr Lattice kCoarse = {21, 13};  // elsewhere
constexpr Lattice kInstant = {8, 5};   // for each of many instants

// Mean albedo, and mean albedo times the cosine to the light.
struct Sum {
  double albedo, lit;
};

Sum lattice_mean(const Stack& stack, const PixelRays& pixel, const Lattice& lattice, u64 key, double void_albedo) {
  const u64 bits = scatter(key);
  const double x0 = static_cast<double>(bits >> 40) * (1.0 / 16777216.0);
  const double y0 = static_cast<double>((bits >> 8) & 0xffffff) * (1.0 / 16777216.0);
  double albedo = 0, lit = 0;
  for (int i = 0; i < lattice.count; ++i) {
    double a = x0 + static_cast<double>(i) / lattice.count;
    double b = y0 + static_cast<double>(i * lattice.step % lattice.count) / lattice.count;
    a -= a >= 1 ? 1.5 : 0.5;
    b -= b >= 1 ? 1.5 : 0.5;
    const Seen seen = stack.look(pixel, a, b, void_albedo);
    albedo += seen.albedo;
    lit += seen.albedo * seen.facing;
  }
  return {albedo / lattice.count, lit / lattice.count};
}

Sum pixel_mean(const Stack& stack, const PixelRays& pixel, const Lattice& lattice, u64 key, double void_albedo) {
  if (stack.lines() >= 2) return lattice_mean(stack, pixel, lattice, key, void_albedo);
  if (stack.lines() == 0) {
    const Seen seen = stack.look(pixel, 0, 0, void_albedo);
    return {seen.albedo, seen.albedo * seen.facing};
  }
  // One straight edge: both sides' colours, just inside the pixel's corners where no other edge can be.
  const double share = inner_share(stack.line());
  const double a = stack.line().ga > 0 ? 0.49 : -0.49, b = stack.line().gb > 0 ? 0.49 : -0.49;
  const Seen inner = stack.look(pixel, a, b, void_albedo), outer = stack.look(pixel, -a, -b, void_albedo);
  return {share * inner.albedo + (1 - share) * outer.albedo,
          share * (inner.albedo * inner.facing) + (1 - share) * (outer.albedo * outer.facing)};
}

const Layer* first_hit(const std::vector<Layer>& layers, const std::vector<int>& order, const PixelRays& pixel) {
  for (int i : order) {
    const Layer& layer = layers[static_cast<std::size_t>(i)];
    if (layer.visible() && layer.hit(pixel.center)) return &layer;
  }
  return nullptr;
}

// Ambient and direct light, and glare, along one ray.
struct Light {
  double ambient, direct, glare;
};

Light light_along(const Lighting& lighting, const Vec2& ray) {
  double direct = lighting.direct * std::max(0.0, 1 + lighting.gradient[0] * ray[0] + lighting.gradient[1] * ray[1]);
  for (const Shadow& shadow : lighting.shadows) {
    const double inside = shadow.normal[0] * ray[0] + shadow.normal[1] * ray[1] - shadow.offset;
    const double s = std::min(1.0, std::max(0.0, inside / shadow.softness + 0.5));
    direct *= 1 - shadow.depth * (s * s * (3 - 2 * s));
  }
  double glare = 0;
  for (const Glare& spot : lighting.glares) {
    const double dx = ray[0] - spot.center[0], dy = ray[1] - spot.center[1];
    const double q = 1 + (dx * dx + dy * dy) / (spot.radius * spot.radius);
    glare += spot.strength / (q * q);
  }
  return {lighting.ambient, direct, glare};
}

}  // namespace

Pose moved(const Motion& motion, const Pose& pose, double tau) {
  const Mat3 turn = small_rotation(scaled(motion.turn, tau));
  Pose result;
  result.R = product(turn, pose.R);
  result.t = add(product(turn, pose.t), scaled(motion.shift, tau));
  return result;
}

double motion_px(const CameraModel& camera, const Motion& motion, double depth_m) {
  const double focal = std::max(camera.fx, camera.fy);
  // Turning about the optical axis moves the corners of the view, turning across it everything.
  const double half_view = 0.5 * (camera.width + camera.height);
  const double across = std::sqrt(motion.turn[0] * motion.turn[0] + motion.turn[1] * motion.turn[1]);
  return focal * (across + length(motion.shift) / std::max(depth_m, 0.05)) + half_view * std::abs(motion.turn[2]);
}

std::vector<double> paint(const Scene& scene, const std::vector<Surface>& surfaces, const RayMap& rays) {
  const int width = rays.camera().width, height = rays.camera().height;
  double nearest = 10;
  for (const SceneMarker& marker : scene.markers) nearest = std::min(nearest, marker.pose.t[2]);
  if (scene.markers.empty()) {  // a board, which is no marker, must not blur in coarse steps
    for (const Surface& surface : surfaces) {
      if (surface.fine) nearest = std::min(nearest, surface.pose.t[2]);
    }
  }
  const double motion = motion_px(rays.camera(), scene.motion, nearest);
  // An odd number, so that the middle one is mid-exposure; steps of a pixel are not seen, since each
  // instant is itself averaged over the pixel.
  const int instants = motion < 0.02 ? 1 : std::min(41, 2 * static_cast<int>(0.5 * motion + 1.5) + 1);

  const Vec3 to_light = normalized(scene.lighting.direction);
  std::vector<std::vector<Layer>> exposures(static_cast<std::size_t>(instants));
  // Bit k of a pixel: an edge runs through it at instant k.
  std::vector<u64> flags(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int k = 0; k < instants; ++k) {
    const double tau = (k - 0.5 * (instants - 1)) / instants;
    for (const Surface& surface : surfaces) {
      const Layer layer(surface, instants == 1 ? surface.pose : moved(scene.motion, surface.pose, tau), to_light);
      if (layer.visible()) mark_edges(layer, rays, u64{1} << k, flags);
      exposures[static_cast<std::size_t>(k)].push_back(layer);
    }
  }
  const Tiles tiles(exposures, rays);

  std::vector<double> radiance(flags.size());
  Stack stack;
  // The layer that the pixel before showed at each instant: this one's as well, where no edge lies between.
  std::vector<const Layer*> shown(static_cast<std::size_t>(instants));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      const PixelRays pixel = pixel_rays(rays, x, y);
      if (x % 64 == 0) std::fill(shown.begin(), shown.end(), nullptr);
      double albedo = 0, lit = 0;
      const auto add_smooth = [&](int k) {
        const Layer*& layer = shown[static_cast<std::size_t>(k)];
        if (layer == nullptr) layer = first_hit(exposures[static_cast<std::size_t>(k)], tiles.layers_at(x, y), pixel);
        const Seen seen = layer != nullptr ? layer->look(pixel.center) : Seen{scene.void_albedo, 0};
        albedo += seen.albedo;
        lit += seen.albedo * seen.facing;
      };
      if (flags[at] == 0) {
        add_smooth(instants / 2);
      } else {
        for (int k = 0; k < instants; ++k) {
          if ((flags[at] >> k & 1) == 0) {
            add_smooth(k);
            continue;
          }
          shown[static_cast<std::size_t>(k)] = nullptr;
          stack.collect(exposures[static_cast<std::size_t>(k)], tiles.layers_at(x, y), pixel);
          const Lattice& lattice = instants > 7 ? kInstant : instants == 1 && stack.fine() ? kFine : kCoarse;
          const Sum sum = pixel_mean(stack, pixel, lattice, at * 64 + static_cast<u64>(k), scene.void_albedo);
          albedo += sum.albedo;
          lit += sum.lit;
        }
        albedo /= instants;
        lit /= instants;
      }
      const Light light = light_along(scene.lighting, pixel.center);
      radiance[at] = albedo * light.ambient + lit * light.direct + light.glare;
    }
  }
  return radiance;
}

}  // namespace berth::sim
