#include "health_show.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace berth::cli {

HealthMode mode_of(const HealthReport& engine, FrameStatus status) {
  if (status == FrameStatus::device_lost) return HealthMode::failed;
  return std::max(engine.mode, status == FrameStatus::overflow ? HealthMode::overflow : HealthMode::nominal);
}

void print_health(std::ostream& people, const HealthReport& engine) {
  if (engine.known_answers == 0 && engine.mode == HealthMode::nominal) return;
  people << fmt::format("health      {}", name_of(engine.mode));
  if (engine.reason[0] != '\0') people << fmt::format(" ({})", engine.reason);
  if (engine.known_answers > 0) {
    people << fmt::format(": {} known answer{}, {} wrong", engine.known_answers, engine.known_answers == 1 ? "" : "s",
                          engine.wrong_answers);
  }
  if (engine.watched_bytes > 0) {
    people << fmt::format("; {:.1f} MB of memory checked {:.1f} times over, {} alterations",
                          static_cast<double>(engine.watched_bytes) / 1e6,
                          static_cast<double>(engine.checked_bytes) / static_cast<double>(engine.watched_bytes),
                          engine.alterations);
  }
  if (engine.tries > 0) {
    people << fmt::format("; backends that were left opened anew {} time{}, {} of them back in use{}", engine.tries,
                          engine.tries == 1 ? "" : "s", engine.returns,
                          engine.recovery[0] == '\0' ? "" : std::string(", ") + engine.recovery);
  }
  people << '\n';
}

Json to_json(const HealthReport& engine) {
  return {{"mode", name_of(engine.mode)},
          {"reason", engine.reason},
          {"known_answers", engine.known_answers},
          {"wrong_answers", engine.wrong_answers},
          {"watched_bytes", engine.watched_bytes},
          {"checked_bytes", engine.checked_bytes},
          {"alterations", engine.alterations},
          {"tries", engine.tries},
          {"returns", engine.returns},
          {"recovery", engine.recovery}};
}

}  // namespace berth::cli
