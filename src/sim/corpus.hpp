#pragma once

#include <string>
#include <vector>

#include "sim/scene.hpp"

namespace berth::sim {

/// Names of the corpora that recall is measured on: easy, dock, hard, tiny, cluttered, dark, motion. What each holds is
/// in docs/simulator.md.
const std::vector<std::string>& corpus_names();

/// Frames of a corpus in its usual length; the dock corpus closes in over these.
constexpr int kCorpusFrames = 100;

/// Frame `index` (any number from 0) of a corpus, for the paper's lens at width × height. Seeds are fixed by name and
/// index. Marker sides in px are the same at every size, except in `dock`, whose markers have sizes in metres. Throws
/// Error on an unknown name, a negative index, or an image too small for the corpus (240 × 180).
Scene corpus_scene(const std::string& name, int index, int width, int height);

}  // namespace berth::sim
