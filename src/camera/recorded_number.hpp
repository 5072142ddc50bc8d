#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "berth/error.hpp"
#include "berth/types.hpp"

namespace berth {

/// The whole number under that key of a JSON object (of either kind of nlohmann's). Throws Error where it is none or T
/// cannot hold it, for which `get` is undefined.
template <class T, class Json>
T whole_number(const Json& json, const char* key) {
  const Json& value = json.at(key);
  const auto refuse = [&] { throw Error(std::string("'") + key + "' is " + value.dump() + ", which cannot be"); };
  if (value.is_number_unsigned()) {
    const u64 number = value.template get<u64>();
    if (number > static_cast<u64>(std::numeric_limits<T>::max())) refuse();
    return static_cast<T>(number);
  }
  if (!value.is_number_integer()) refuse();
  const std::int64_t number = value.template get<std::int64_t>();
  // Of negative ones; unsigned types have none.
  if (std::numeric_limits<T>::min() == 0 || number < static_cast<std::int64_t>(std::numeric_limits<T>::min())) refuse();
  return static_cast<T>(number);
}

}  // namespace berth
