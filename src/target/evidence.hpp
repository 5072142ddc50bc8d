#pragma once

#include "target/blur.hpp"

namespace berth {

/// How much likelier the reading is if the marker bears the word than if it bears a random pattern (2^cells patterns,
/// all alike), for Gaussian noise of unknown size and the given blur.
///
/// From the word, single cells are turned over as long as that explains the reading better. A true code gains nothing
/// but noise by it; a pattern that is merely near a code gains much. The sum over all patterns is taken as that
/// of the independent cells about the best one.
double evidence_against_chance(const Layout& layout, const Reading& reading, u64 word, BlurTaps taps);

}  // namespace berth
