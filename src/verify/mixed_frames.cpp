#include "verify/mixed_frames.hpp"

#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/pictures.hpp"

namespace berth {
namespace {

constexpr int kKinds = 10;  // the seven corpora and three that no camera gives

}  // namespace

MixedFrames::MixedFrames() = default;
MixedFrames::~MixedFrames() = default;

MixedFrames::Frame MixedFrames::make(int index) {
  const bool is_large = index % 8 == 7;
  const int width = is_large ? 640 : 320;
  const int height = is_large ? 480 : 240;
  const int kind = index % kKinds;
  const int seed = index / kKinds;
  const std::string number = "_" + std::to_string(seed);
  const u64 random = static_cast<u64>(index) * 2654435761u + 1;
  if (kind == 7)
    return {"noise" + number, pictures::noise(width, height, {90, 97, 98, 104, 108, 118, 119, 140}, random)};
  if (kind == 8) return {"mazes" + number, pictures::mazes(width, height, random)};
  if (kind == 9) return {"quads" + number, pictures::quads(width, height, 24, 4, random)};
  const std::string& corpus = sim::corpus_names()[static_cast<std::size_t>(kind)];
  const sim::Scene scene = sim::corpus_scene(corpus, seed, width, height);
  std::unique_ptr<sim::Renderer>& renderer = is_large ? large_ : small_;
  if (!renderer) renderer = std::make_unique<sim::Renderer>(scene.camera);
  return {corpus + number, renderer->render(scene)};
}

}  // namespace berth
