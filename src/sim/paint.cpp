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
    stack_.clear();
    lines_ = 0;
    for (int i : order) {
      const Layer& layer = layers[static_cast<std::size_t>(i)];
      const int before = lines_;
      const PixelLine one = line_;
      const Cover cover = cross_outline(layer, pixel);
      if (cover == Cover::none) {
        lines_ = before;
        line_ = one;
        continue;
      }
      if (layer.surface().cells.size() > 1) cross_cells(layer, pixel);
      stack_.push_back(&layer);
      if (cover == Cover::full) break;
    }
  }
  int lines() const { return lines_; }
  const PixelLine& line() const { return line_; }

  Seen look(const Vec2& ray, double void_albedo) const {
    for (const Layer* layer : stack_) {
      if (layer->hit(ray)) return layer->look(ray);
    }
    return {void_albedo, 0};
  }

 private:
  enum class Cover { none, part, full };

  void cross(const PixelLine& line) {
    line_ = line;
    ++lines_;
  }

  Cover cross_outline(const Layer& layer, const PixelRays& pixel) {
    if (!layer.visible()) return Cover::none;
    bool full = true;
    for (int i = 0; i < layer.sides(); ++i) {
      const PixelLine line = over_pixel(layer.side(i), pixel);
      const double reach = line.reach();
      if (line.value <= -reach) return Cover::none;
      if (line.value < reach) {
        full = false;
        cross(line);
      }
    }
    if (!layer.disc()) return full ? Cover::full : Cover::part;
    if (!full) return Cover::part;
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
    lines_ += 2;  // curved: for the lattice
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

  std::vector<const Layer*> stack_;
  int lines_ = 0;
  PixelLine line_{};
};

// Fibonacci lattices: point i is (i / count, i · step / count mod 1). Every pixel and instant has its own offset.
struct Lattice {
  int count, step;
};
constexpr Lattice kStill = {55, 34};
constexpr Lattice kMoving = {21, 13};

Seen lattice_mean(const Stack& stack, const PixelRays& pixel, const Lattice& lattice, u64 key, double void_albedo) {
  const u64 bits = scatter(key);
  const double x0 = static_cast<double>(bits >> 40) * (1.0 / 16777216.0);
  const double y0 = static_cast<double>((bits >> 8) & 0xffffff) * (1.0 / 16777216.0);
  double albedo = 0, lit = 0;
  for (int i = 0; i < lattice.count; ++i) {
    double a = x0 + static_cast<double>(i) / lattice.count;
    double b = y0 + static_cast<double>(i * lattice.step % lattice.count) / lattice.count;
    a -= a >= 1 ? 1.5 : 0.5;
    b -= b >= 1 ? 1.5 : 0.5;
    const Seen seen = stack.look(pixel.at(a, b), void_albedo);
    albedo += seen.albedo;
    lit += seen.albedo * seen.facing;
  }
  return {albedo / lattice.count, lit / lattice.count};
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
  const double motion = motion_px(rays.camera(), scene.motion, nearest);
  // An odd number, so that the middle one is mid-exposure; two instants a pixel leave no steps that the blur would not
  // hide.
  const int instants = motion < 0.02 ? 1 : std::min(41, 2 * static_cast<int>(motion + 1.5) + 1);

  const Vec3 to_light = normalized(scene.lighting.direction);
  std::vector<std::vector<Layer>> exposures(static_cast<std::size_t>(instants));
  std::vector<u8> flags(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int k = 0; k < instants; ++k) {
    const double tau = (k - 0.5 * (instants - 1)) / instants;
    for (const Surface& surface : surfaces) {
      const Layer layer(surface, instants == 1 ? surface.pose : moved(scene.motion, surface.pose, tau), to_light);
      if (layer.visible()) mark_edges(layer, rays, flags);
      exposures[static_cast<std::size_t>(k)].push_back(layer);
    }
  }
  const std::vector<Layer>& middle = exposures[static_cast<std::size_t>(instants / 2)];
  const Tiles tiles(exposures, rays);
  const Lattice lattice = instants == 1 ? kStill : kMoving;

  std::vector<double> radiance(flags.size());
  Stack stack;
  for (int y = 0; y < height; ++y) {
    const Layer* shown = nullptr;  // by the pixel before, where no edge lies between
    for (int x = 0; x < width; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      const PixelRays pixel = pixel_rays(rays, x, y);
      double albedo = 0, lit = 0;
      if (flags[at] == 0) {
        if (x % Tiles::kSide_px == 0) shown = nullptr;
        if (shown == nullptr) {
          for (int i : tiles.layers_at(x, y)) {
            const Layer& layer = middle[static_cast<std::size_t>(i)];
            if (!layer.visible() || !layer.hit(pixel.center)) continue;
            shown = &layer;
            break;
          }
        }
        const Seen seen = shown != nullptr ? shown->look(pixel.center) : Seen{scene.void_albedo, 0};
        albedo = seen.albedo;
        lit = seen.albedo * seen.facing;
      } else {
        shown = nullptr;
        for (int k = 0; k < instants; ++k) {
          stack.collect(exposures[static_cast<std::size_t>(k)], tiles.layers_at(x, y), pixel);
          if (stack.lines() >= 2) {
            const Seen mean = lattice_mean(stack, pixel, lattice, at * 64 + static_cast<u64>(k), scene.void_albedo);
            albedo += mean.albedo;
            lit += mean.facing;
            continue;
          }
          double share = 1, a = 0, b = 0;
          if (stack.lines() == 1) {
            share = inner_share(stack.line());
            // Just inside the pixel's corners, where no other line can be.
            a = stack.line().ga > 0 ? 0.49 : -0.49;
            b = stack.line().gb > 0 ? 0.49 : -0.49;
          }
          const Seen inner = stack.look(pixel.at(a, b), scene.void_albedo);
          albedo += share * inner.albedo;
          lit += share * (inner.albedo * inner.facing);
          if (share < 1) {
            const Seen outer = stack.look(pixel.at(-a, -b), scene.void_albedo);
            albedo += (1 - share) * outer.albedo;
            lit += (1 - share) * (outer.albedo * outer.facing);
          }
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
