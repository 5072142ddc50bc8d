#include "web_messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "health_show.hpp"

namespace berth::cli {
namespace {

constexpr double kMicro = 1e6, kTenThousandth = 1e4;

}  // namespace

Json rounded(double value, double scale) {
  if (!std::isfinite(value)) return nullptr;
  return std::round(value * scale) / scale;
}

std::string new_run_name() {
  std::random_device device;
  return fmt::format("{:08x}{:08x}", device(), device());
}

Json to_json(const WebAbout& about) {
  Json json = {{"run", about.run},
               {"source", about.source},
               {"backend", about.backend},
               {"width", about.width},
               {"height", about.height},
               {"filtered", about.is_filtered},
               {"control", about.can_control},
               {"version", BERTH_VERSION}};
  if (about.camera) json["camera"] = {about.camera->fx, about.camera->fy, about.camera->cx, about.camera->cy};
  return json;
}

Json to_json(const WebStatus& status, double now_s, bool ended) {
  Json json = {{"now", rounded(now_s, kTenThousandth)},
               {"ended", ended},
               {"frames", status.frames},
               {"with_pose", status.with_pose},
               {"fps", rounded(status.frames_per_second, 10)}};
  // The rest is of the newest frame.
  if (status.frames == 0) return json;
  json["finished"] = rounded(status.finished_s, kTenThousandth);
  json["captured"] = rounded(status.captured_s, kTenThousandth);
  json["captured_known"] = status.captured_known;
  json["sequence"] = status.sequence;
  json["label"] = status.label.data();
  json["status"] = name_of(status.status);
  json["mode"] = name_of(status.mode);
  json["search"] = !status.is_tracked ? "whole frames" : status.is_whole ? "the whole frame" : "windows";
  json["why"] = status.is_tracked ? Json(name_of(status.why)) : Json();
  json["backend"] = status.backend;
  json["overflows"] = status.overflows;
  const bool is_stale = !ended && now_s - status.finished_s > kStaleAfterS;
  const HealthMode mode =
      std::max(mode_of(status.engine, status.status), is_stale ? HealthMode::stale : HealthMode::nominal);
  json["health"] = to_json(status.engine);
  json["health"]["mode"] = name_of(mode);
  json["health"]["text"] = text_of(mode);
  json["valid"] = mode < HealthMode::stale;
  json["camera"] = {{"lost", status.health.lost},         {"incomplete", status.health.incomplete},
                    {"repeated", status.health.repeated}, {"misdated", status.health.misdated},
                    {"skipped", status.health.skipped},   {"reopened", status.health.reopened}};
  if (!status.is_paced) return json;
  Json& pipeline = json["pipeline"];
  pipeline = {{"offered", status.counts.offered},
              {"delivered", status.counts.delivered},
              {"run_again", status.counts.run_again},
              {"device_lost", status.counts.device_lost},
              {"late", status.counts.late}};
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    pipeline["dropped"][name_of(static_cast<DropCause>(i))] = status.counts.dropped[i];
  }
  return json;
}

Json to_json(const std::vector<WebObject>& objects) {
  Json json = Json::array();
  for (const WebObject& object : objects) {
    json.push_back({{"name", object.name}, {"kind", object.kind}, {"size", object.size_m}});
  }
  return json;
}

Json to_json(const WebSample& sample) {
  Json json = {rounded(sample.time_s, kTenThousandth), sample.object};
  for (const double value : sample.axes.value) json.push_back(rounded(value, kMicro));
  for (const double deviation : sample.axes.deviation) json.push_back(rounded(deviation, kMicro * 10));
  json.push_back(rounded(sample.range_m, kMicro));
  json.push_back(rounded(sample.range_deviation_m, kMicro * 10));
  json.push_back(rounded(sample.closing_m_s, kMicro));
  json.push_back(rounded(sample.closing_deviation_m_s, kMicro));
  json.push_back(rounded(sample.error_px, kTenThousandth));
  json.push_back(rounded(sample.ambiguity, kTenThousandth));
  return json;
}

}  // namespace berth::cli
