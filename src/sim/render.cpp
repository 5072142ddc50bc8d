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

// Means over squares of factor × factor.
std::vector<double> binned(const std::vector<double>& fine, int width, int height, int factor) {
  std::vector<double> result;
  result.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int i = 0; i < factor * factor; ++i) {
        const std::size_t row = static_cast<std::size_t>(y * factor + i / factor);
        sum += fine[row * static_cast<std::size_t>(width * factor) + static_cast<std::size_t>(x * factor + i % factor)];
      }
      result.push_back(sum / (factor * factor));
    }
  }
  return result;
}

}  // namespace

Renderer::Renderer(const CameraModel& camera, int fineness)
    : fineness_(fineness), rays_(camera), fine_rays_(fineness > 1 ? RayMap(magnified(camera, fineness)) : rays_) {}

GrayImage Renderer::render(const Scene& scene) const {
  if (!same_camera(scene.camera, rays_.camera())) {
    throw Error("simulator: the scene's camera is not the renderer's: make a Renderer for each camera");
  }
  std::vector<double> radiance = paint(scene, drawn(scene).surfaces, fine_rays_);
  if (fineness_ == 1) return sensor_.expose(scene.sensor, rays_, std::move(radiance), scene.seed);
  const CameraModel& fine = fine_rays_.camera();
  disc_blur(radiance, fine.width, fine.height, fineness_ * scene.sensor.defocus_px);
  gaussian_blur(radiance, fine.width, fine.height, fineness_ * scene.sensor.blur_sigma_px);
  Sensor sensor = scene.sensor;
  sensor.blur_sigma_px = sensor.defocus_px = 0;
  return sensor_.expose(sensor, rays_, binned(radiance, camera().width, camera().height, fineness_), scene.seed);
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
