#pragma once

#include <string>

namespace berth {

/// The shortest decimal that reads back as exactly the same finite double; never depends on the locale.
std::string shortest_decimal(double value);

/// Reads all of `text` as a decimal number, whatever the locale. Returns false on anything else (also inf and nan).
bool parse_decimal(const std::string& text, double& value);

}  // namespace berth
