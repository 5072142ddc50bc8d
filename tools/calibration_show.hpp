#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calibration/calibrate.hpp"

namespace berth::cli {

/// "[######----] 63 %": the share of the image that the views cover.
std::string coverage_bar(const ViewSet& set);
/// The image's fields, a row each: how many points each has, from '.' for none to '#'.
std::vector<std::string> coverage_map(const ViewSet& set);

/// The result for people: camera, standard deviations and the views that fit worst.
std::string calibration_text(const Calibration& calibration, const ViewSet& set);
nlohmann::ordered_json calibration_json(const Calibration& calibration, const ViewSet& set, const Board& board);

/// Two plots: where in the image the points' residuals point, enlarged; and all residuals together.
std::string residual_svg(const Calibration& calibration, const ViewSet& set);

}  // namespace berth::cli
