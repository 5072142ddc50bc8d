#include "navset/scene.hpp"

#include <algorithm>

namespace berth::navset {

double bounding_radius(const Model& model) {
  double radius = 0;
  for (const Part& part : model) radius = std::max(radius, sim::length(part.pose.t) + bounding_radius(part.shape));
  return radius;
}

void append(Model& model, const Model& part, const Pose& pose) {
  for (Part p : part) {
    p.pose = sim::compose(pose, p.pose);
    model.push_back(p);
  }
}

void Scene::place(const Model& model, const Pose& pose, double scale, Owner owner) {
  const std::size_t first = items_.size();
  for (const Part& part : model) {
    Item item{part.shape, part.material, sim::product(pose.R, part.pose.R), {}, {}, 0, owner};
    for (double& size : item.shape.size) size *= scale;
    item.material.scale *= scale;
    item.position = sim::add(pose.t, sim::product(pose.R, sim::scaled(part.pose.t, scale)));
    item.eye = sim::scaled(sim::product(sim::transposed(item.rotation), item.position), -1);
    item.radius = bounding_radius(item.shape);
    items_.push_back(item);
  }
  groups_.push_back({pose.t, scale * bounding_radius(model), first, items_.size()});
}

}  // namespace berth::navset
