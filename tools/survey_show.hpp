#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "survey/survey.hpp"

namespace berth::cli {

/// The result for people: a line for each marker with its place, how well it is known and how it fits.
std::string survey_text(const Survey& survey);
nlohmann::ordered_json survey_json(const Survey& survey);

/// The markers as the origin's viewer sees them, and from above: two plots.
std::string layout_svg(const Survey& survey);

}  // namespace berth::cli
