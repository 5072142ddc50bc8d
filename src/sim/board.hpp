#pragma once

#include <vector>

#include "sim/scene.hpp"
#include "target/board.hpp"

namespace berth::sim {

class TomlReader;

/// A board on white paper, as surfaces in the board's frame: far to near.
std::vector<Surface> board_surfaces(const Board& board, double white, double black);

/// Reads [board] (docs/simulator.md) and lays it out.
std::vector<Surface> read_board(TomlReader reader);

}  // namespace berth::sim
