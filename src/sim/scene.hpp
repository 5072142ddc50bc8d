#pragma once

#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/disc_target.hpp"
#include "berth/marker.hpp"
#include "berth/types.hpp"
#include "sim/geometry.hpp"

namespace berth::sim {

/// The most corners a Surface's outline may have.
constexpr int kMaxOutline = 8;

/// A flat, matt thing: a convex polygon, a disc or a ring, painted with a grid of rectangular cells. Everything in a
/// scene is made of these. Plane frame: x right and y down as seen from the front, z away from the viewer; a surface
/// seen from behind is not drawn. Lengths in metres, albedo 0 (black) … 1 (white).
struct Surface {
  /// Plane frame to camera frame, at mid-exposure.
  Pose pose;
  /// Corners of the convex outline, clockwise as seen from the front, 3 … kMaxOutline; unused for a disc.
  std::vector<Vec2> outline;
  /// A disc (or ring) about the plane's origin when outer_radius > 0.
  double outer_radius = 0, inner_radius = 0;
  /// Cell (column, row) covers [left + column·cell_width, …] × [top + row·cell_height, …]; points beyond the grid take
  /// the nearest cell.
  int columns = 1, rows = 1;
  double left = 0, top = 0, cell_width = 1, cell_height = 1;
  /// Albedo of each cell, row-major [rows, columns].
  std::vector<double> cells = {0.5};
  /// Relative change of the albedo per metre along x and y.
  Vec2 slope = {0, 0};
  /// Smooth random texture: relative amplitude and wavelength.
  double grain = 0, grain_m = 0.01;
  /// Rendered with more points a pixel: markers, and what looks like one.
  bool fine = false;
};

/// A printed marker on its plate.
struct SceneMarker {
  std::string family = "tag36h11";
  int id = 0;
  /// Side of the border square, as in Detection::corners and MarkerFamily::border_width.
  double size_m = 0.1;
  /// Marker frame (origin in the middle, x right, y down, z into the plate) to camera frame, at mid-exposure.
  Pose pose;
  /// Light margin around the pattern's total_width, in modules.
  double margin_modules = 0.5;
  /// Width of the plate's frame around the margin, m; 0 for none.
  double plate_m = 0;
  double plate_albedo = 0.45;
  double white = 0.88, black = 0.05;
};

/// A target of discs, printed dark on a light plate.
struct SceneTarget {
  DiscTarget target;
  /// Target frame to camera frame, at mid-exposure.
  Pose pose;
  /// Light margin around all that is printed, m.
  double margin_m = 0.015;
  double white = 0.88, black = 0.05;
};

/// A half-plane of shade in the view: points with normal · ray > offset, ray = (x/z, y/z), lose `depth` of the direct
/// light; the edge is a smooth step `softness` wide.
struct Shadow {
  Vec2 normal = {1, 0};
  double offset = 0;
  double softness = 0.02;
  double depth = 0.7;
};

/// Stray light of a lamp or of the sun in the lens: adds strength / (1 + (d / radius)²)² to the radiance, d the
/// distance of the ray from `center`. 1 is a white surface's radiance.
struct Glare {
  Vec2 center = {0, 0};
  double radius = 0.05;
  double strength = 0.5;
};

struct Lighting {
  /// A white surface that faces the direct light has radiance ambient + direct.
  double ambient = 0.35, direct = 0.65;
  /// From the scene to the light, camera frame; normalised when used.
  Vec3 direction = {0, 0, -1};
  /// Relative change of the direct light per unit of ray (x/z, y/z).
  Vec2 gradient = {0, 0};
  std::vector<Shadow> shadows;
  std::vector<Glare> glares;
};

/// From radiance to grey levels; the order of the fields is the order of the effects.
struct Sensor {
  /// Share of the natural cos⁴ fall-off of a simple lens, 0 … 1.
  double vignetting = 0.3;
  /// Gaussian blur of lens and pixel crosstalk, and the radius of an out-of-focus disc, px.
  double blur_sigma_px = 0.7, defocus_px = 0;
  /// Grey levels of radiance 1 and of no light.
  double white_level = 210, black_level = 8;
  /// Electrons at 255 grey levels above black: the shot noise.
  double full_well_e = 20000;
  /// Tone curve: out = 255 · (in / 255)^gamma; 1 is linear.
  double gamma = 1;
  /// Noise of amplifier and converter, grey levels, after the tone curve.
  double read_noise = 1.8;
};

/// How everything moves in the camera frame during the exposure: X(τ) = rotation(τ·turn)·X + τ·shift, τ = −½ … ½.
struct Motion {
  Vec3 shift = {0, 0, 0};
  /// Rotation vector, rad.
  Vec3 turn = {0, 0, 0};
};

/// A frame to render. Later surfaces hide earlier ones: background, markers, targets, foreground.
struct Scene {
  CameraModel camera;
  /// Albedo where no surface is (deep space, an open door), lit by the ambient light alone.
  double void_albedo = 0.02;
  std::vector<Surface> background;
  std::vector<SceneMarker> markers;
  std::vector<SceneTarget> targets;
  std::vector<Surface> foreground;
  Lighting lighting;
  Sensor sensor;
  Motion motion;
  /// Of the noise; the textures have their own place in `grain`.
  u64 seed = 1;
};

}  // namespace berth::sim
