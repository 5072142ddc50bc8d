#include "berth/health.hpp"

namespace berth {

const char* name_of(HealthMode mode) {
  switch (mode) {
    case HealthMode::nominal:
      return "nominal";
    case HealthMode::overflow:
      return "overflow";
    case HealthMode::fallback:
      return "fallback";
    case HealthMode::stale:
      return "stale";
    case HealthMode::failed:
      return "failed";
  }
  return "unknown";
}

const char* text_of(HealthMode mode) {
  switch (mode) {
    case HealthMode::nominal:
      return "frames come out whole";
    case HealthMode::overflow:
      return "a frame held more than there is room for";
    case HealthMode::fallback:
      return "a backend failed; another carries on, with the same bits";
    case HealthMode::stale:
      return "no result for longer than the time-out";
    case HealthMode::failed:
      return "no backend is left that gives right answers";
  }
  return "unknown";
}

}  // namespace berth
