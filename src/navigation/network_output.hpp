#pragma once

#include "navigation/network.hpp"

namespace berth {

/// What a network says of one window, in fixed point: "Scores and geometry" of docs/network-arithmetic.md.
struct NetworkOutput {
  int score_q15 = 0;  ///< that the target is there: 0 to 32768
  int logit_q8 = 0;   ///< its log-odds, -2048 to 2047
  /// Where the network has geometry: the target's centre and its circumscribed diameter, px of the window.
  s32 x_q16 = 0;
  s32 y_q16 = 0;
  s32 d_q16 = 0;
};

/// The score of log-odds in 1/256.
int score_of(const Network& network, int logit_q8);

/// From the sums of the heads: two scores, and three more with geometry.
NetworkOutput network_output(const Network& network, const s32* sums);

}  // namespace berth
