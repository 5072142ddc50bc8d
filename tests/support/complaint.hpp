#pragma once

#include <functional>
#include <string>

#include "berth/error.hpp"

namespace berth::test {

/// What the Error says that `act` ends in; empty where it ends in none.
inline std::string complaint(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace berth::test
