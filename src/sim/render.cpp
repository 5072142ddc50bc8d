#include "sim/render.hpp"

#include <algorithm>
#include <string>

#include "berth/error.hpp"
#include "sim/layer.hpp"
#include "sim/paint.hpp"
#include "sim/printed_marker.hpp"
#include "sim/printed_target.hpp"

namespace berth::sim {
namespace {

bool same_camera(const CameraModel& a, const CameraModel& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy &&
         a.distortion == b.distortion && a.lens == b.lens;
}

// Every surface, far to near, and for each marker the place of its pattern in the list.
struct Drawn {
  std::vector<Surface> surfaces;
  std::vector<std::size_t> patterns;
};

Drawn drawn(const Scene& scene) {
  Drawn result;
  result.surfaces = scene.background;
  for (const SceneMarker& marker : scene.markers) {
    for (Surface& surface : marker_surfaces(marker)) result.surfaces.push_back(std::move(surface));
    result.patterns.push_back(result.surfaces.size() - 1);
  }
  for (const SceneTarget& target : scene.targets) {
    for (Surface& surface : target_surfaces(target)) result.surfaces.push_back(std::move(surface));
  }
  result.surfaces.insert(result.surfaces.end(), scene.foreground.begin(), scene.foreground.end());
  return result;
}

// Points a side where the visible share is looked up.
constexpr int kVisiblePoints = 40;

double visible_share(const Scene& scene, const std::vector<Layer>& layers, std::size_t pattern, double side_m) {
  if (!layers[pattern].visible()) return 0;
  int seen = 0;
  for (int i = 0; i < kVisiblePoints * kVisiblePoints; ++i) {
    const int column = i % kVisiblePoints, row = i / kVisiblePoints;
    const Vec2 on_plane = {((column + 0.5) / kVisiblePoints - 0.5) * side_m,
                           ((row + 0.5) / kVisiblePoints - 0.5) * side_m};
    const Vec3 point = layers[pattern].camera_point(on_plane);
    if (point[2] < kNear_m) continue;
    const Vec2 ray = {point[0] / point[2], point[1] / point[2]};
    const Vec2 pixel = image_point(scene.camera, ray);
    if (!(pixel[0] >= -0.5 && pixel[1] >= -0.5 && pixel[0] <= scene.camera.width - 0.5 &&
          pixel[1] <= scene.camera.height - 0.5)) {
      continue;
    }
    bool hidden = false;
    for (std::size_t j = pattern + 1; j < layers.size() && !hidden; ++j) {
      hidden = layers[j].visible() && layers[j].hit(ray);
    }
    if (!hidden) ++seen;
  }
  return static_cast<double>(seen) / (kVisiblePoints * kVisiblePoints);
}

CameraModel magnified(CameraModel camera, int factor) {
  camera.width *= factor;
  camera.height *= factor;
  camera.fx *= factor;
  camera.fy *= factor;
  // Pixel centres are at integers: scaling is about the image's corner, (-1/2, -1/2).
  camera.cx = (camera.cx + 0.5) * factor - 0.5;
  camera.cy = (camera.cy + 0.5) * factor - 0.5;
  return camera;
}

// Pixels, ends not included.
struct Window {
  int left, top, right, bottom;
  bool empty() const { return left >= right || top >= bottom; }
  bool holds(const Window& other) const {
    return left <= other.left && top <= other.top && right >= other.right && bottom >= other.bottom;
  }
  Window wider(int by, const CameraModel& camera) const {
    return {std::max(0, left - by), std::max(0, top - by), std::min(camera.width, right + by),
            std::min(camera.height, bottom + by)};
  }
};

// The pixels where a surface may be seen; all where a part of it is beside or behind the camera.
Window window_of(const Surface& surface, const CameraModel& camera) {
  constexpr int kPoints = 16;  // along a side, which a lens may bend
  const Window all = {0, 0, camera.width, camera.height};
  std::vector<Vec2> outline = surface.outline;
  if (surface.outer_radius > 0) outline = rectangle(2 * surface.outer_radius, 2 * surface.outer_radius);
  Vec2 low = {1e9, 1e9}, high = {-1e9, -1e9};
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 &a = outline[i], &b = outline[(i + 1) % outline.size()];
    for (int k = 0; k < kPoints; ++k) {
      const double s = static_cast<double>(k) / kPoints;
      const Vec3 at = transform(surface.pose, Vec3{a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), 0});
      if (at[2] < kNear_m) return all;
      const Vec2 pixel = image_point(camera, {at[0] / at[2], at[1] / at[2]});
      for (std::size_t axis = 0; axis < 2; ++axis) {
        if (!(pixel[axis] > -1e6 && pixel[axis] < 1e6)) return all;
        low[axis] = std::min(low[axis], pixel[axis]);
        high[axis] = std::max(high[axis], pixel[axis]);
      }
    }
  }
  const auto pixel = [](double place) { return static_cast<int>(floor_int(place)); };
  return Window{pixel(low[0]), pixel(low[1]), pixel(high[0]) + 2, pixel(high[1]) + 2}.wider(0, camera);
}

}  // namespace

Renderer::Renderer(const CameraModel& camera, int fineness)
    : fineness_(fineness), rays_(camera), fine_rays_(fineness > 1 ? RayMap(magnified(camera, fineness)) : rays_) {}

GrayImage Renderer::render(const Scene& scene) const {
  if (!same_camera(scene.camera, rays_.camera())) {
    throw Error("simulator: the scene's camera is not the renderer's: make a Renderer for each camera");
  }
  const std::vector<Surface> surfaces = drawn(scene).surfaces;
  std::vector<double> radiance = paint(scene, surfaces, rays_);
  if (fineness_ == 1) return sensor_.expose(scene.sensor, rays_, std::move(radiance), scene.seed);
  Sensor sensor = scene.sensor;
  disc_blur(radiance, camera().width, camera().height, sensor.defocus_px);
  gaussian_blur(radiance, camera().width, camera().height, sensor.blur_sigma_px);
  std::vector<Window> refined;
  for (const Surface& surface : surfaces) {
    if (!surface.fine) continue;
    // A board's squares lie on its paper.
    const Window window = window_of(surface, camera());
    if (std::any_of(refined.begin(), refined.end(), [&](const Window& other) { return other.holds(window); })) continue;
    refine(scene, surfaces, surface, radiance);
    refined.push_back(window);
  }
  sensor.blur_sigma_px = sensor.defocus_px = 0;
  return sensor_.expose(sensor, rays_, std::move(radiance), scene.seed);
}

// Replaces the blurred radiance on and about a surface by means of what is painted and blurred in smaller pixels.
void Renderer::refine(const Scene& scene, const std::vector<Surface>& surfaces, const Surface& about,
                      std::vector<double>& radiance) const {
  const Sensor& sensor = scene.sensor;
  // As far as the blur carries, and twice: once for where the surface shows, once for what is seen there.
  const int reach = static_cast<int>(4 * sensor.blur_sigma_px + sensor.defocus_px) + 2;
  const double moves = motion_px(camera(), scene.motion, std::max(kNear_m, about.pose.t[2]));
  const Window inner = window_of(about, camera()).wider(reach + static_cast<int>(moves) + 1, camera());
  if (inner.empty()) return;
  const Window outer = inner.wider(reach, camera());
  const int width = fineness_ * (outer.right - outer.left), height = fineness_ * (outer.bottom - outer.top);
  const RayMap rays = fine_rays_.part(fineness_ * outer.left, fineness_ * outer.top, width, height);
  std::vector<double> fine = paint(scene, surfaces, rays);
  disc_blur(fine, width, height, fineness_ * sensor.defocus_px);
  gaussian_blur(fine, width, height, fineness_ * sensor.blur_sigma_px);
  for (int y = inner.top; y < inner.bottom; ++y) {
    for (int x = inner.left; x < inner.right; ++x) {
      double sum = 0;
      for (int row = fineness_ * (y - outer.top); row < fineness_ * (y - outer.top + 1); ++row) {
        const std::size_t first = static_cast<std::size_t>(row * width + fineness_ * (x - outer.left));
        for (int k = 0; k < fineness_; ++k) sum += fine[first + static_cast<std::size_t>(k)];
      }
      radiance[static_cast<std::size_t>(y * camera().width + x)] = sum / (fineness_ * fineness_);
    }
  }
}

GrayImage render(const Scene& scene) { return Renderer(scene.camera).render(scene); }

std::vector<TruthMarker> truth(const Scene& scene) {
  const Drawn all = drawn(scene);
  std::vector<Layer> layers;
  for (const Surface& surface : all.surfaces) {
    layers.emplace_back(surface, surface.pose, normalized(scene.lighting.direction));
  }
  std::vector<TruthMarker> result;
  for (std::size_t i = 0; i < scene.markers.size(); ++i) {
    const SceneMarker& marker = scene.markers[i];
    TruthMarker one;
    one.family = marker.family;
    one.id = marker.id;
    one.size_m = marker.size_m;
    one.pose = marker.pose;
    const std::array<Vec3, 4> corners = marker_corners(marker.size_m);
    bool in_front = true;
    for (std::size_t j = 0; j < 4; ++j) {
      const Vec3 corner = transform(marker.pose, corners[j]);
      in_front = in_front && corner[2] >= kNear_m;
      one.corners[j] = image_point(scene.camera, {corner[0] / corner[2], corner[1] / corner[2]});
    }
    const MarkerFamily& shape = berth::family(marker.family);
    const double side_m = marker.size_m / shape.border_width * needed_modules(shape);
    one.visible = in_front ? visible_share(scene, layers, all.patterns[i], side_m) : 0;
    result.push_back(one);
  }
  return result;
}

std::vector<TruthTarget> truth_targets(const Scene& scene) {
  std::vector<TruthTarget> result;
  for (const SceneTarget& target : scene.targets) result.push_back({target.target.name, target.pose});
  return result;
}

}  // namespace berth::sim
