#include "target/number_text.hpp"

#include <locale>
#include <sstream>

namespace berth {

// GCC 8 has no std::from_chars or to_chars for double; streams with the classic locale round correctly in both
// directions.
std::string shortest_decimal(double value) {
  std::string text;
  for (int digits = 1; digits <= 17; ++digits) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(digits);
    out << value;
    text = out.str();
    double back = 0;
    // Numbers of everyday size are written out: 480, not 4.8e+02.
    const bool everyday = value < 1e15 && value > -1e15 && (value >= 1e-5 || value <= -1e-5 || value == 0);
    const bool written_out = text.find('e') == std::string::npos || !everyday;
    if (written_out && parse_decimal(text, back) && back == value) break;
  }
  return text;
}

bool parse_decimal(const std::string& text, double& value) {
  if (text.find_first_not_of("0123456789+-.eE") != std::string::npos) return false;
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  return static_cast<bool>(in >> value) && in.peek() == std::istringstream::traits_type::eof();
}

}  // namespace berth
