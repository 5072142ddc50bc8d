#include "navset/target.hpp"

#include <algorithm>
#include <cmath>

#include "sim/printed_marker.hpp"

namespace berth::navset {
namespace {

constexpr double kBody = 0.062, kBodyLength = 0.07;  // half sides
constexpr double kPlate = 0.034, kPlate_z = -kBodyLength - 0.006;
constexpr double kWingWidth = 0.055, kWingThickness = 0.002;

class Builder {
 public:
  Builder(const Livery& livery, u64 wear) : livery_(livery), random_(wear) {}

  Model body() {
    const double tone = random_.uniform(0.88, 1.12);
    Material skin = textured(livery_.body, std::min(0.95, livery_.body_albedo * tone), livery_.body_second,
                             livery_.body == Texture::foil ? 0.018 : 0.05, random_.bits());
    if (livery_.body == Texture::foil) skin = foil(skin.albedo, 0.018, skin.seed);
    Model model{box({kBody, kBody, kBodyLength}, {0, 0, 0}, skin)};
    // Decks on both ends and posts along the edges.
    const Material deck = textured(Texture::panels, livery_.deck, 0.1, 0.05, random_.bits());
    for (int end = -1; end <= 1; end += 2) {
      model.push_back(box({kBody + 0.003, kBody + 0.003, 0.004}, {0, 0, end * kBodyLength}, deck));
    }
    for (int i = 0; i < 4; ++i) {
      const double x = (i & 1) != 0 ? kBody : -kBody, y = (i & 2) != 0 ? kBody : -kBody;
      model.push_back(box({0.006, 0.006, kBodyLength + 0.004}, {x, y, 0}, plain(livery_.trim, 0.3)));
    }
    // Star tracker and second marker plate on +y.
    model.push_back(
        part(ShapeKind::frustum, {0.012, 0.018, 0.016}, {0.04, kBody + 0.016, -0.045}, plain(0.06), kAlongY));
    model.push_back(tag_plate(2, 0.032, {-0.016, kBody + 0.004, 0.03}, kAlongY));
    return model;
  }

  Model ring() {
    const double z = -kBodyLength - 0.004;
    Model model{part(ShapeKind::tube, {0.058, 0.058, 0.012}, {0, 0, z - 0.012}, metal(livery_.ring)),
                part(ShapeKind::tube, {0.051, 0.051, 0.012}, {0, 0, z - 0.012}, metal(0.8 * livery_.ring)),
                part(ShapeKind::ring, {0.058, 0.051, 0}, {0, 0, z - 0.024}, metal(livery_.ring))};
    for (int i = 0; i < 3; ++i) {
      // Guides lean inwards, a third of a turn apart.
      const double angle = 2 * sim::kPi * i / 3 + 0.5;
      const Mat3 turn = sim::product(sim::rotation_z(angle), sim::rotation_y(-0.35));
      const Vec3 at{0.053 * sim::exact_cos(angle), 0.053 * sim::exact_sin(angle), z - 0.03};
      model.push_back(box({0.002, 0.012, 0.012}, at, metal(0.9 * livery_.ring), turn));
    }
    return model;
  }

  Model plate() { return {tag_plate(kDockMarker, kPlate, {0, 0, kPlate_z}, kAgainstZ)}; }

  Model engine() {
    const double z = kBodyLength + 0.004;
    Model model{part(ShapeKind::tube, {0.012, 0.036, 0.022}, {0, 0, z + 0.022}, metal(0.3)),
                part(ShapeKind::ring, {0.012, 0, 0}, {0, 0, z + 0.001}, plain(0.03))};
    for (int i = 0; i < 4; ++i) {
      const double x = (i & 1) != 0 ? 0.046 : -0.046, y = (i & 2) != 0 ? 0.046 : -0.046;
      model.push_back(box({0.012, 0.012, 0.008}, {x, y, z + 0.006}, plain(livery_.trim, 0.3)));
      model.push_back(part(ShapeKind::tube, {0.003, 0.009, 0.009}, {x, y, z + 0.022}, metal(0.4)));
      model.push_back(part(ShapeKind::tube, {0.003, 0.008, 0.008}, {x + (x > 0 ? 0.019 : -0.019), y, z + 0.006},
                           metal(0.4), x > 0 ? kAlongX : kAgainstX));
    }
    return model;
  }

  Model wing(int side) {
    const double half_z = kWingWidth;
    // The outer corner is where the circumscribed sphere touches.
    const double r = kTargetDiameter_m / 2;
    const double tip = std::sqrt(r * r - half_z * half_z - kWingThickness * kWingThickness);
    const double root = 0.085, gap = 0.002, middle = (root + tip) / 2;
    Model model{cylinder(0.005, 0.014, {side * (kBody + 0.013), 0, 0}, plain(livery_.trim, 0.4), kAlongX)};
    const Material cells = solar_cells(livery_.cell, livery_.line, 0.0157, random_.bits());
    for (int k = 0; k < 2; ++k) {
      const double from = k == 0 ? root : middle + gap, to = k == 0 ? middle - gap : tip;
      model.push_back(box({(to - from) / 2, kWingThickness, half_z}, {side * (from + to) / 2, 0, 0}, cells));
    }
    model.push_back(box({(tip - root) / 2 - 0.002, 0.0015, 0.002}, {side * (root + tip) / 2, 0.003, 0}, plain(0.5)));
    return model;
  }

  Model dish() {
    const double y = -kBody;
    const Material face = plain(livery_.dish, 0.4, 3);
    return {cylinder(0.004, 0.016, {0, y - 0.016, 0.03}, plain(0.5, 0.4), kAlongY),
            part(ShapeKind::tube, {0.012, 0.044, 0.011}, {0, y - 0.043, 0.03}, face, kAgainstY),
            part(ShapeKind::ring, {0.013, 0, 0}, {0, y - 0.033, 0.03}, face, kAgainstY),
            cylinder(0.002, 0.015, {0, y - 0.048, 0.03}, plain(0.3), kAlongY)};
  }

 private:
  const Livery& livery_;
  sim::Random random_;
};

void join(Model& model, const Model& more) { model.insert(model.end(), more.begin(), more.end()); }

}  // namespace

Pose dock_marker_pose() { return sim::translation(0, 0, kPlate_z); }

const std::vector<Livery>& liveries() {
  static const std::vector<Livery> all = {
      {"white", Texture::panels, 0.82, 0.15, 0.75, 0.10, 0.55, 0.60, 0.70, 0.90},
      {"gold-foil", Texture::foil, 0.55, 0.55, 0.30, 0.08, 0.45, 0.55, 0.35, 0.85},
      {"silver-foil", Texture::foil, 0.75, 0.75, 0.20, 0.12, 0.60, 0.30, 0.55, 0.80},
      {"black-kapton", Texture::foil, 0.10, 0.10, 0.55, 0.07, 0.40, 0.65, 0.20, 0.75},
      {"grey-sheet", Texture::panels, 0.45, 0.80, 0.15, 0.14, 0.50, 0.20, 0.60, 0.60},
      {"banded", Texture::bands, 0.80, 0.25, 0.60, 0.09, 0.50, 0.45, 0.30, 0.85},
      {"copper-foil", Texture::foil, 0.40, 0.40, 0.70, 0.16, 0.35, 0.75, 0.75, 0.50},
      {"dark-sheet", Texture::panels, 0.22, 0.70, 0.65, 0.06, 0.30, 0.70, 0.25, 0.70},
      {"chequered", Texture::checks, 0.85, 0.20, 0.40, 0.11, 0.55, 0.35, 0.70, 0.30},
      {"fabric", Texture::grain, 0.60, 0.85, 0.25, 0.09, 0.50, 0.25, 0.45, 0.88},
      {"white-cells", Texture::cells, 0.13, 0.50, 0.80, 0.13, 0.60, 0.60, 0.80, 0.90},
      {"pale-foil", Texture::foil, 0.65, 0.65, 0.50, 0.20, 0.10, 0.50, 0.15, 0.40},
  };
  return all;
}

Part tag_plate(int id, double half, const Vec3& at, const Mat3& rotation) {
  const MarkerFamily& family = berth::family("tag36h11");
  Material face;
  face.texture = Texture::tag;
  face.scale = half;
  face.specular = 0.05;
  auto pattern = std::make_shared<Pattern>();
  pattern->side = family.total_width + 2;
  pattern->cells = sim::pattern_cells(family, family.codes[static_cast<std::size_t>(id)], 0.9, 0.04);
  face.pattern = std::move(pattern);
  return part(ShapeKind::plate, {half, half, 0}, at, face, rotation);
}

Model target_model(const Livery& livery, u64 wear) {
  Builder builder(livery, wear);
  Model model = builder.body();
  join(model, builder.ring());
  join(model, builder.plate());
  join(model, builder.engine());
  join(model, builder.wing(-1));
  join(model, builder.wing(1));
  join(model, builder.dish());
  return model;
}

Model target_piece(const Livery& livery, Piece piece, u64 wear) {
  Builder builder(livery, wear);
  Model model;
  switch (piece) {
    case Piece::wing:
      model = builder.wing(1);
      break;
    case Piece::ring:
      model = builder.ring();
      join(model, builder.plate());
      model.push_back(box({0.065, 0.065, 0.004}, {0, 0, -kBodyLength}, plain(livery.deck)));
      break;
    case Piece::engine:
      model = builder.engine();
      model.push_back(box({0.065, 0.065, 0.004}, {0, 0, kBodyLength}, plain(livery.deck)));
      break;
    case Piece::dish:
      model = builder.dish();
      break;
    default:
      model = builder.plate();
      break;
  }
  // About its own middle.
  Vec3 middle{};
  for (const Part& p : model) middle = sim::add(middle, sim::scaled(p.pose.t, 1.0 / static_cast<double>(model.size())));
  for (Part& p : model) p.pose.t = sim::add(p.pose.t, sim::scaled(middle, -1));
  return model;
}

}  // namespace berth::navset
