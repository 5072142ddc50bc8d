#pragma once

#include <vector>

#include "berth/marker.hpp"
#include "navset/material.hpp"

namespace berth::navset {

/// One shape with its look, in its model's frame.
struct Part {
  Shape shape;
  Material material;
  Pose pose;
};

/// A thing made of parts, about its own origin, metres.
using Model = std::vector<Part>;

/// Radius of the sphere about the model's origin that holds its parts' bounding spheres.
double bounding_radius(const Model& model);
/// Puts `part` with its frame turned and moved.
void append(Model& model, const Model& part, const Pose& pose);

enum class Owner : u8 { target, other };

/// Models placed before a camera in its origin that looks along z, x right, y down.
class Scene {
 public:
  struct Item {
    Shape shape;
    Material material;
    Mat3 rotation;  ///< shape's frame to camera's
    Vec3 position;
    Vec3 eye;  ///< the camera in the shape's frame
    double radius;
    Owner owner;
  };
  struct Group {
    Vec3 position;
    double radius;
    std::size_t first, last;
  };

  void place(const Model& model, const Pose& pose, double scale, Owner owner);
  const std::vector<Item>& items() const { return items_; }
  const std::vector<Group>& groups() const { return groups_; }

 private:
  std::vector<Item> items_;
  std::vector<Group> groups_;
};

}  // namespace berth::navset
