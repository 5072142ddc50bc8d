#include "navset/render.hpp"

#include <algorithm>
#include <cmath>

namespace berth::navset {
namespace {

// The tiles' size moves no bit: it only decides which parts are tried where.
constexpr int kTile_px = 8;
// A shadow ray starts this far off its surface, metres: more than rounding, less than any part.
constexpr double kLift_m = 1e-6;

struct Rectangle {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // last ones excluded
};

int clamped_floor(double x) { return static_cast<int>(floor_int(std::min(1e6, std::max(-1e6, x)))); }

// The slopes x / z between which a sphere at (x, z) lies, as seen from the origin.
void slopes(double x, double z, double radius, double& low, double& high) {
  const double rest = z * z - radius * radius;
  const double root = std::sqrt(std::max(0.0, x * x + z * z - radius * radius)) * radius;
  low = (x * z - root) / rest;
  high = (x * z + root) / rest;
}

Rectangle projection(const Vec3& position, double radius, const Camera& camera) {
  if (position[2] + radius <= 0) return {};
  if (position[2] - radius < 1e-3) return {-1000000, -1000000, 1000000, 1000000};
  double left = 0, right = 0, top = 0, bottom = 0;
  slopes(position[0], position[2], radius, left, right);
  slopes(position[1], position[2], radius, top, bottom);
  return {clamped_floor(camera.cx + camera.focal_px * left - 0.5),
          clamped_floor(camera.cy + camera.focal_px * top - 0.5),
          clamped_floor(camera.cx + camera.focal_px * right + 0.5) + 2,
          clamped_floor(camera.cy + camera.focal_px * bottom + 0.5) + 2};
}

// Half extents of a box about the shape, in its frame.
Vec3 half_extents(const Shape& shape) {
  const Vec3& s = shape.size;
  switch (shape.kind) {
    case ShapeKind::box:
      return s;
    case ShapeKind::frustum:
    case ShapeKind::tube: {
      const double r = std::max(s[0], s[1]);
      return {r, r, s[2]};
    }
    case ShapeKind::ring:
      return {s[0], s[0], 0};
    case ShapeKind::plate:
      return {s[0], s[1], 0};
    default: {
      const double r = bounding_radius(shape);
      return {r, r, r};
    }
  }
}

// The part of the image an item may be in: inside its sphere's and inside that of its box's corners.
Rectangle projection(const Scene::Item& item, const Camera& camera) {
  Rectangle area = projection(item.position, item.radius, camera);
  const Vec3 half = half_extents(item.shape);
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (int i = 0; i < 8; ++i) {
    const Vec3 local{(i & 1) != 0 ? half[0] : -half[0], (i & 2) != 0 ? half[1] : -half[1],
                     (i & 4) != 0 ? half[2] : -half[2]};
    const Vec3 corner = sim::add(item.position, sim::product(item.rotation, local));
    if (corner[2] < 1e-3) return area;
    left = std::min(left, corner[0] / corner[2]);
    right = std::max(right, corner[0] / corner[2]);
    top = std::min(top, corner[1] / corner[2]);
    bottom = std::max(bottom, corner[1] / corner[2]);
  }
  area.x0 = std::max(area.x0, clamped_floor(camera.cx + camera.focal_px * left - 0.5));
  area.y0 = std::max(area.y0, clamped_floor(camera.cy + camera.focal_px * top - 0.5));
  area.x1 = std::min(area.x1, clamped_floor(camera.cx + camera.focal_px * right + 0.5) + 2);
  area.y1 = std::min(area.y1, clamped_floor(camera.cy + camera.focal_px * bottom + 0.5) + 2);
  return area;
}

struct Hit {
  double t = 1e30;
  int item = -1;
  Vec3 normal{};  // in the item's frame
};

class Drawing {
 public:
  Drawing(const Scene& scene, const Camera& camera, const Light& light, const Surroundings& surroundings)
      : scene_(scene), camera_(camera), light_(light), surroundings_(surroundings) {
    for (const Scene::Item& item : scene.items()) {
      areas_.push_back(projection(item, camera));
      nearest_depth_.push_back(item.position[2] - item.radius);
      sphere_.push_back(sim::dot(item.position, item.position) - item.radius * item.radius);
      keys_.push_back(sim::product(sim::transposed(item.rotation), light.key));
    }
  }

  Sighting run(int across, std::vector<double>& radiance) {
    Rectangle all{0, 0, camera_.width, camera_.height};
    for (std::size_t i = 0; i < areas_.size(); ++i) {
      if (scene_.items()[i].owner != Owner::target) continue;
      // The silhouette counts beyond the image's edge as well.
      all.x0 = std::min(all.x0, std::max(areas_[i].x0, -camera_.width));
      all.y0 = std::min(all.y0, std::max(areas_[i].y0, -camera_.height));
      all.x1 = std::max(all.x1, std::min(areas_[i].x1, 2 * camera_.width));
      all.y1 = std::max(all.y1, std::min(areas_[i].y1, 2 * camera_.height));
    }
    for (int y = all.y0; y < all.y1; y += kTile_px) {
      for (int x = all.x0; x < all.x1; x += kTile_px) {
        draw_tile({x, y, std::min(all.x1, x + kTile_px), std::min(all.y1, y + kTile_px)}, across, radiance);
      }
    }
    if (sighting_.visible > 0) sighting_.contrast /= static_cast<double>(sighting_.visible);
    return sighting_;
  }

 private:
  void draw_tile(const Rectangle& tile, int across, std::vector<double>& radiance) {
    candidates_.clear();
    targets_ = 0;
    // The target's parts first, so that its silhouette is known before anything hides it.
    for (int pass = 0; pass < 2; ++pass) {
      for (std::size_t i = 0; i < areas_.size(); ++i) {
        const Rectangle& area = areas_[i];
        if ((scene_.items()[i].owner == Owner::target) != (pass == 0)) continue;
        if (area.x0 >= tile.x1 || area.x1 <= tile.x0 || area.y0 >= tile.y1 || area.y1 <= tile.y0) continue;
        candidates_.push_back(static_cast<int>(i));
      }
      // Near ones first: what lies behind a hit need not be tried.
      std::stable_sort(candidates_.begin() + targets_, candidates_.end(), [this](int a, int b) {
        return nearest_depth_[static_cast<std::size_t>(a)] < nearest_depth_[static_cast<std::size_t>(b)];
      });
      if (pass == 0) targets_ = static_cast<int>(candidates_.size());
    }
    const bool inside_x = tile.x1 > 0 && tile.x0<camera_.width, inside_y = tile.y1> 0 && tile.y0 < camera_.height;
    if (candidates_.empty() || (targets_ == 0 && !(inside_x && inside_y))) return;
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) draw_pixel(x, y, across, radiance);
    }
  }

  void draw_pixel(int x, int y, int across, std::vector<double>& radiance) {
    const bool inside = x >= 0 && y >= 0 && x < camera_.width && y < camera_.height;
    if (!inside && targets_ == 0) return;
    const std::size_t at =
        inside ? static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(x)
               : 0;
    const double behind = inside ? radiance[at] : 0;
    double sum = 0;
    int covered = 0;
    for (int k = 0; k < across * across; ++k) {
      const int column = k % across, row = k / across;
      const double dx = (column + 0.5) / across - 0.5, dy = (row + 0.5) / across - 0.5;
      const Vec3 ray{(x + dx - camera_.cx) / camera_.focal_px, (y + dy - camera_.cy) / camera_.focal_px, 1};
      bool on_target = false;
      const Hit hit = nearest(ray, on_target);
      if (on_target) {
        ++sighting_.silhouette;
        if (inside) sighting_.full_box.include(x, y);
      }
      if (!inside || hit.item < 0) continue;
      ++covered;
      const double value = shade(hit, ray);
      sum += value;
      if (scene_.items()[static_cast<std::size_t>(hit.item)].owner == Owner::target) {
        ++sighting_.visible;
        sighting_.visible_box.include(x, y);
        sighting_.contrast += std::abs(std::min(1.0, value) - std::min(1.0, behind));
      }
    }
    if (covered > 0) radiance[at] = (sum + behind * (across * across - covered)) / (across * across);
  }

  Hit nearest(const Vec3& ray, bool& on_target) const {
    Hit hit;
    const double square = sim::dot(ray, ray);
    const int count = static_cast<int>(candidates_.size());
    int k = 0;
    for (int end = targets_; end <= count; end = end < count ? count : count + 1) {
      for (; k < end; ++k) {
        const int i = candidates_[static_cast<std::size_t>(k)];
        const auto at = static_cast<std::size_t>(i);
        // The ray's z is 1, so t is depth.
        if (nearest_depth_[at] > hit.t) break;
        const Scene::Item& item = scene_.items()[at];
        // The bounding sphere first: most parts are missed.
        const double b = sim::dot(item.position, ray);
        if (sphere_[at] * square > b * b) continue;
        const Vec3 direction = turned_back(item.rotation, ray);
        if (intersect(item.shape, item.eye, direction, 1e-4, hit.t, hit.normal)) hit.item = i;
      }
      k = end;
      if (end == targets_) on_target = hit.item >= 0;
    }
    return hit;
  }

  static Vec3 turned_back(const Mat3& m, const Vec3& v) {
    return {m[0] * v[0] + m[3] * v[1] + m[6] * v[2], m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
            m[2] * v[0] + m[5] * v[1] + m[8] * v[2]};
  }

  bool shadowed(const Vec3& point) const {
    for (const Scene::Group& group : scene_.groups()) {
      if (!towards_light(group.position, group.radius, point)) continue;
      for (std::size_t i = group.first; i < group.last; ++i) {
        const Scene::Item& item = scene_.items()[i];
        if (item.material.glow > 0) continue;
        if (!towards_light(item.position, item.radius, point)) continue;
        const Vec3 from = turned_back(
            item.rotation, {point[0] - item.position[0], point[1] - item.position[1], point[2] - item.position[2]});
        double t = 1e30;
        Vec3 normal;
        if (intersect(item.shape, from, keys_[i], 1e-9, t, normal)) return true;
      }
    }
    return false;
  }

  // Whether the ray from `point` to the key light may meet the sphere.
  bool towards_light(const Vec3& position, double radius, const Vec3& point) const {
    const Vec3 to{position[0] - point[0], position[1] - point[1], position[2] - point[2]};
    const double along = sim::dot(to, light_.key), square = sim::dot(to, to), r2 = radius * radius;
    if (square <= r2) return true;
    return along > 0 && square - along * along <= r2;
  }

  double shade(const Hit& hit, const Vec3& ray) const {
    const Scene::Item& item = scene_.items()[static_cast<std::size_t>(hit.item)];
    const Material& material = item.material;
    const Vec3 ray_here = turned_back(item.rotation, ray);
    const Vec3 local = sim::add(item.eye, sim::scaled(ray_here, hit.t));
    const Vec3 flat = sim::normalized(hit.normal);
    const Vec2 uv = surface_coordinates(item.shape, local, flat);
    const SurfaceLook look = look_at(material, uv[0], uv[1]);
    Vec3 normal = sim::product(item.rotation, flat);
    if (sim::dot(normal, ray) > 0) normal = sim::scaled(normal, -1);
    const Vec3 true_normal = normal;
    if (look.tilt_u != 0 || look.tilt_v != 0) {
      // Any two directions along the surface will do: tilts are noise.
      const Vec3 axis = std::abs(normal[0]) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
      const Vec3 along = sim::normalized(sim::cross(normal, axis)), across = sim::cross(normal, along);
      normal = sim::normalized(
          sim::add(normal, sim::add(sim::scaled(along, look.tilt_u), sim::scaled(across, look.tilt_v))));
    }
    const Vec3 view = sim::scaled(ray, -1 / sim::length(ray));
    double diffuse = light_.ambient * (0.65 + 0.35 * sim::dot(normal, light_.up));
    const double wrapped = 0.5 + 0.5 * sim::dot(normal, light_.fill);
    diffuse += light_.fill_strength * wrapped * wrapped;
    double highlight = 0;
    const double facing = sim::dot(normal, light_.key);
    if (light_.key_strength > 0 && facing > 0 && sim::dot(true_normal, light_.key) > 0) {
      const Vec3 point = sim::add(sim::scaled(ray, hit.t), sim::scaled(true_normal, kLift_m));
      if (!shadowed(point)) {
        diffuse += light_.key_strength * facing;
        const double half = sim::dot(normal, sim::normalized(sim::add(view, light_.key)));
        if (half > 0) {
          double power = half;
          for (int i = 0; i < material.gloss; ++i) power *= power;
          highlight = material.specular * power * light_.key_strength;
        }
      }
    }
    double value = look.albedo * diffuse + highlight + material.glow;
    if (material.mirror > 0 && surroundings_.pixels != nullptr) {
      const Vec3 mirrored = sim::add(sim::scaled(normal, 2 * sim::dot(normal, view)), sim::scaled(view, -1));
      value += material.mirror * seen_by_mirror(mirrored);
    }
    return value;
  }

  double seen_by_mirror(const Vec3& direction) const {
    const int side = surroundings_.side;
    const auto place = [side](double x) {
      return std::min(side - 1, std::max(0, static_cast<int>((0.5 + 0.49 * x) * side)));
    };
    const std::size_t at = static_cast<std::size_t>(place(direction[1])) * static_cast<std::size_t>(side) +
                           static_cast<std::size_t>(place(direction[0]));
    return surroundings_.gain * surroundings_.pixels[at] * (1.0 / 255);
  }

  const Scene& scene_;
  const Camera& camera_;
  const Light& light_;
  const Surroundings& surroundings_;
  std::vector<Rectangle> areas_;
  std::vector<double> nearest_depth_, sphere_;  // of each item's sphere: z of its nearest point, |position|² - radius²
  std::vector<Vec3> keys_;                      // the key light's direction in each item's frame
  std::vector<int> candidates_;
  int targets_ = 0;
  Sighting sighting_;
};

}  // namespace

void Sighting::Box::include(int x, int y) {
  x0 = std::min(x0, x);
  y0 = std::min(y0, y);
  x1 = std::max(x1, x);
  y1 = std::max(y1, y);
}

Sighting draw(const Scene& scene, const Camera& camera, const Light& light, const Surroundings& surroundings,
              int samples_across, std::vector<double>& radiance) {
  return Drawing(scene, camera, light, surroundings).run(samples_across, radiance);
}

}  // namespace berth::navset
