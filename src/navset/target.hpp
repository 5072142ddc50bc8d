#pragma once

#include <string>

#include "navset/parts.hpp"

namespace berth::navset {

/// Diameter of the sphere about the target's origin that its farthest points, the wings' tips, lie on. d = f·D/Z.
constexpr double kTargetDiameter_m = 0.4;

/// Beside its ring (-z) the target has marker 1 of tag36h11, of this side, upright where x is right and y down.
constexpr int kDockMarker = 1;
constexpr double kDockMarkerSide_m = 0.068 * 8 / 12;  // 8 of the plate's 12 modules
/// From the marker's frame to the target's.
Pose dock_marker_pose();

/// How the one target may be painted and wrapped.
struct Livery {
  std::string name;
  Texture body;
  double body_albedo, body_second;
  double trim;        ///< posts along the edges, yokes
  double cell, line;  ///< solar cells and what is between them
  double ring;        ///< docking ring
  double deck;        ///< the faces that carry ring and engine
  double dish;
};

const std::vector<Livery>& liveries();

/// The target: a body of 12 × 12 × 14 cm with a docking ring round a marker plate (-z), an engine and thrusters (+z),
/// two wings of two panels (±x), a dish on a mast (-y), a second plate and a star tracker (+y). `wear` varies tones a
/// little.
Model target_model(const Livery& livery, u64 wear);

/// What must not be taken for the target: one of its pieces alone.
enum class Piece { wing, ring, engine, dish, plate, count };
Model target_piece(const Livery& livery, Piece piece, u64 wear);

/// A square plate with an AprilTag 36h11 on it, facing its +z.
Part tag_plate(int id, double half, const Vec3& at, const Mat3& rotation);

}  // namespace berth::navset
