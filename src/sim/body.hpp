#pragma once

#include <vector>

#include "sim/random.hpp"
#include "sim/scene.hpp"

namespace berth::sim {

/// A satellite-like target: a box with blanketed sides, a framed front with docking ring, bolts, thrusters, handrails
/// and labels, and two solar wings. Body frame: origin in the middle of the front, x right and y down as seen from the
/// front, z into the body.
struct BodyLook {
  double width_m = 0.46, height_m = 0.40, depth_m = 0.40;
  bool wings = true;
  bool ring = true;
  /// Albedo of the front's sheet metal.
  double albedo = 0.42;
  u64 seed = 1;
};

/// Adds the body, far to near. What is on the front lies in the plane z = 0; handrails stand 30 mm proud.
void add_body(std::vector<Surface>& surfaces, const Pose& body, const BodyLook& look);

/// Adds the markers of a docking target to the front: tag36h11 id 0, side 100 mm, in the middle, and ids 1 to 4, side
/// 30 mm, at (±90, ±55) mm: upper left, lower left, lower right, upper right.
void add_dock_markers(Scene& scene, const Pose& body);

/// Adds a gripper's finger that reaches from outside of the view to near `tip` (a ray), `width` across, in ray units.
void add_finger(std::vector<Surface>& surfaces, const Vec2& tip, double angle_rad, double width, double depth_m,
                double albedo);

/// Building blocks, centred at (x, y) of the plane frame `at`.
Surface flat(const Pose& at, double x, double y, double width, double height, double albedo);
Surface turned(Surface surface, double angle_rad);
Surface disc(const Pose& at, double x, double y, double outer, double inner, double albedo);
/// Lettering seen from too far to read: blocks of strokes, `letters` long, on the given ground.
Surface lettering(const Pose& at, double x, double y, double height, int letters, double ink, double ground,
                  Random& random);

}  // namespace berth::sim
