#include "target/number_text.hpp"

#include <cfloat>
#include <clocale>
#include <cstdio>
#include <cstdlib>

// GCC 8 has no std::from_chars or to_chars for double, and streams would bring all of the C++ library's locales into
// the flight core. The C library's own functions round correctly in both directions; they have the locale's decimal
// point.

namespace berth {
namespace {

void replace_first(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at != std::string::npos) text.replace(at, from.size(), to);
}

}  // namespace

std::string shortest_decimal(double value) {
  char text[40];
  for (int digits = 1; digits <= DBL_DECIMAL_DIG; ++digits) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    // Numbers of everyday size are written out: 480, not 4.8e+02.
    const bool everyday = value < 1e15 && value > -1e15 && (value >= 1e-5 || value <= -1e-5 || value == 0);
    const bool written_out = std::string(text).find('e') == std::string::npos || !everyday;
    if (written_out && std::strtod(text, nullptr) == value) break;
  }
  std::string result = text;
  replace_first(result, std::localeconv()->decimal_point, ".");
  return result;
}

bool parse_decimal(const std::string& text, double& value) {
  if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string::npos) return false;
  std::string here = text;
  replace_first(here, ".", std::localeconv()->decimal_point);
  char* end = nullptr;
  const double parsed = std::strtod(here.c_str(), &end);
  if (*end != 0 || !(parsed <= DBL_MAX && parsed >= -DBL_MAX)) return false;
  value = parsed;
  return true;
}

}  // namespace berth
