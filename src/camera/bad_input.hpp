#pragma once

#include <string>

#include "berth/error.hpp"

namespace berth {

/// The Error for input a person gave: "FILE: field 'FIELD' is VALUE; REMEDY". `where` is a file name or "command line".
inline Error bad_field(const std::string& where, const std::string& field, const std::string& value,
                       const std::string& remedy) {
  return Error(where + ": field '" + field + "' is " + value + "; " + remedy);
}

}  // namespace berth
