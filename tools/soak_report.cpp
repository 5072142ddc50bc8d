#include "soak_report.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <utility>

#include "berth/error.hpp"

namespace berth::cli {
namespace {

constexpr std::size_t kViolationsKept = 100;

double megabytes(u64 bytes) { return static_cast<double>(bytes) / 1e6; }

void raise(SoakMemory& most, const SoakMemory& memory) {
  most.resident = std::max(most.resident, memory.resident);
  most.allocated = std::max(most.allocated, memory.allocated);
}

}  // namespace

SoakMemory memory_now() {
  SoakMemory memory;
#ifdef __GLIBC__
  // What was freed goes back to the system, or what is resident says more of malloc than of Berth.
  malloc_trim(0);
#if __GLIBC_PREREQ(2, 33)
  const struct mallinfo2 info = mallinfo2();
  memory.allocated = info.uordblks + info.hblkhd;
#endif
#endif
  // Not what is mapped from files: drivers' libraries come in page by page as their parts are first used.
  u64 all = 0, resident = 0, of_files = 0;
  std::ifstream("/proc/self/statm") >> all >> resident >> of_files;
  memory.resident = (resident - of_files) * static_cast<u64>(sysconf(_SC_PAGESIZE));
  return memory;
}

void SoakReport::begin_run() {
  ++runs;
  since_start = 0;
  settled = most = {};
}

void SoakReport::add(const SoakOutcome& outcome, double seconds_taken, const SoakMemory& memory) {
  tally.add(outcome.tally);
  seconds += seconds_taken;
  ++since_start;
  std::vector<SoakViolation> found = outcome.violations;
  if (since_start <= kSettled) {
    raise(settled, memory);
  } else {
    const auto check = [&](const char* what, u64 now, u64 settled_at, u64 most_growth) {
      if (now <= settled_at + most_growth) return;
      found.push_back({next, std::nullopt,
                       fmt::format("{} is {:.1f} MB, after {:.1f} MB in the first {} scenarios", what, megabytes(now),
                                   megabytes(settled_at), kSettled)});
    };
    check("resident memory", memory.resident, settled.resident, kMostResidentGrowth);
    check("allocated memory", memory.allocated, settled.allocated, kMostAllocatedGrowth);
  }
  raise(most, memory);
  violation_count += found.size();
  for (SoakViolation& violation : found) {
    if (violations.size() < kViolationsKept) violations.push_back(std::move(violation));
  }
  ++next;
}

std::string command_of(const SoakReport& report, const SoakViolation& violation) {
  return fmt::format("berth soak --seed {} --scenario {}", report.seed, violation.scenario);
}

Json to_json(const SoakReport& report) {
  Json json = {{"berth", BERTH_VERSION},     {"seed", report.seed}, {"next", report.next},
               {"seconds", report.seconds},  {"runs", report.runs}, {"violation_count", report.violation_count},
               {"violations", Json::array()}};
  for (const SoakViolation& violation : report.violations) {
    Json row = {{"scenario", violation.scenario}};
    if (violation.frame) row["frame"] = *violation.frame;
    row["what"] = violation.what;
    row["command"] = command_of(report, violation);
    json["violations"].push_back(row);
  }
  const SoakTally& tally = report.tally;
  for (const auto& [name, count] : kSoakCounts) json["counts"][name] = tally.*count;
  for (const auto& [name, count] : kSourceCounts) json["camera"][name] = tally.camera.*count;
  for (std::size_t i = 1; i < kCameraFaults; ++i) {
    json["camera_faults"][name_of(static_cast<CameraFault>(i))] = tally.camera_faults[i];
  }
  json["kinds"] = tally.kinds;
  json["memory"] = {{"since_start", report.since_start},
                    {"settled_resident", report.settled.resident},
                    {"settled_allocated", report.settled.allocated},
                    {"most_resident", report.most.resident},
                    {"most_allocated", report.most.allocated}};
  return json;
}

SoakReport read_soak_report(const std::string& file, u64 seed) {
  const std::string remedy = "give another --state file, or delete it";
  SoakReport report;
  try {
    std::ifstream stream(file);
    const Json json = Json::parse(stream);
    if (json.at("seed") != seed || json.at("berth") != BERTH_VERSION) {
      throw Error(file + ": it is of another soak (seed or version); " + remedy);
    }
    report.seed = seed;
    report.next = json.at("next");
    report.seconds = json.at("seconds");
    report.runs = json.at("runs");
    report.violation_count = json.at("violation_count");
    for (const Json& row : json.at("violations")) {
      SoakViolation violation;
      violation.scenario = row.at("scenario");
      if (row.contains("frame")) violation.frame = row.at("frame").get<u64>();
      violation.what = row.at("what");
      report.violations.push_back(violation);
    }
    SoakTally& tally = report.tally;
    for (const auto& [name, count] : kSoakCounts) tally.*count = json.at("counts").at(name);
    for (const auto& [name, count] : kSourceCounts) tally.camera.*count = json.at("camera").at(name);
    for (std::size_t i = 1; i < kCameraFaults; ++i) {
      tally.camera_faults[i] = json.at("camera_faults").at(name_of(static_cast<CameraFault>(i)));
    }
    tally.kinds = json.at("kinds").get<std::map<std::string, u64>>();
  } catch (const Json::exception& error) {
    throw Error(file + ": no state of berth soak (" + error.what() + "); " + remedy);
  }
  return report;
}

void print(std::ostream& out, const SoakReport& report) {
  const SoakTally& t = report.tally;
  out << fmt::format(
      "{} scenarios of seed {} in {:.2f} h, {} run{}: {} frames with a result, {} poses, {} violation{}\n\n",
      t.scenarios, report.seed, report.seconds / 3600, report.runs, report.runs == 1 ? "" : "s", t.frames, t.poses,
      report.violation_count, report.violation_count == 1 ? "" : "s");
  out << "| fault | begun | what became of it |\n|---|---|---|\n";
  for (std::size_t i = 1; i < kCameraFaults; ++i) {
    const auto fault = static_cast<CameraFault>(i);
    out << fmt::format("| camera: {} | {} | {} |\n", name_of(fault), t.camera_faults[i], fate_of(fault));
  }
  out << fmt::format(
      "| device to be lost, or to hang | {} and {} | in {} scenarios it came to that: another backend carried on, same "
      "bits; in {} it took over again |\n",
      t.devices_lost, t.devices_hung, t.failed_over, t.returned);
  out << fmt::format("| device stalled | {} scenarios | late or dropped, counted |\n", t.devices_stalled);
  out << fmt::format("| thread stopped for 100 ms | {} | late or dropped, counted |\n", t.threads_stopped);
  out << fmt::format("| disk full | {} of {} recordings | said, frames went on; {} recovered, the rest whole |\n\n",
                     t.disks_full, t.recordings, t.recovered);
  out << "| of frames | |\n|---|---|\n";
  out << fmt::format(
      "| with a result | {} |\n| of these compared with a plain run on another backend, bit for bit | {} |\n", t.frames,
      t.compared);
  out << fmt::format("| dropped for newer ones | {} |\n| lost before they came | {} |\n| incomplete | {} |\n",
                     t.dropped, t.camera.lost, t.camera.incomplete);
  out << fmt::format("| repeated | {} |\n| with impossible times | {} |\n| times a camera was opened again | {} |\n\n",
                     t.camera.repeated, t.camera.misdated, t.camera.reopened);
  out << "| scenarios | |\n|---|---|\n";
  for (const auto& [kind, count] : t.kinds) out << fmt::format("| {} | {} |\n", kind, count);
  out << fmt::format(
      "\nmemory after a scenario, since the last start {} scenarios ago: at most {:.1f} MB resident and {:.1f} MB "
      "allocated; {:.1f} and {:.1f} in the first {}\n",
      report.since_start, megabytes(report.most.resident), megabytes(report.most.allocated),
      megabytes(report.settled.resident), megabytes(report.settled.allocated), kSettled);
  for (const SoakViolation& violation : report.violations) {
    out << fmt::format("violation: scenario {}{}: {}; {}\n", violation.scenario,
                       violation.frame ? fmt::format(", frame {}", *violation.frame) : std::string(), violation.what,
                       command_of(report, violation));
  }
}

}  // namespace berth::cli
