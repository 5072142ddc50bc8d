// berth chaos: single bits turned over in memory, and who notices.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>

#include "berth/backend.hpp"
#include "berth/error.hpp"
#include "camera/bad_input.hpp"
#include "commands.hpp"
#include "frame_json.hpp"
#include "interrupt.hpp"
#include "output_file.hpp"
#include "verify/chaos.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth chaos                                    10,000 flips, and who noticed
  berth chaos --flips 120000 --json chaos.json   goes on where the file ends; Ctrl-C stops it
  berth chaos --backend cpu --seed 7

Every flip is one bit in one frame, tried in a child process. The exit code is 1 where, with lockstep, a wrong
pose went unnoticed on its frame.)";

/// Flips between two savings of the report, and between two lines of progress.
constexpr u64 kSaveEvery = 2000;
constexpr std::chrono::milliseconds kTellEvery{500};

struct ChaosCommand {
  u64 flips = 10000;
  u64 seed = 1;
  std::string backend = "simd";
  std::string file;
};

/// A tally's counts by name, in the order of the report.
using Count = u64 ChaosTally::*;
constexpr std::array<std::pair<const char*, Count>, 14> kCounts = {{
    {"flips", &ChaosTally::flips},
    {"masked", &ChaosTally::masked},
    {"by_status", &ChaosTally::by_status},
    {"by_crash", &ChaosTally::by_crash},
    {"by_scrub", &ChaosTally::by_scrub},
    {"by_known_answer", &ChaosTally::by_known_answer},
    {"silent", &ChaosTally::silent},
    {"late_wrong_pose", &ChaosTally::late_wrong_pose},
    {"wrong_pose", &ChaosTally::wrong_pose},
    {"in_lockstep", &ChaosTally::in_lockstep},
    {"lockstep_late", &ChaosTally::lockstep_late},
    {"lockstep_silent", &ChaosTally::lockstep_silent},
    {"lockstep_wrong_pose", &ChaosTally::lockstep_wrong_pose},
    {"seen_masked", &ChaosTally::seen_masked},
}};

void save(const std::string& file, const std::string& backend, const ChaosReport& report) {
  if (file.empty()) return;
  Json json = {{"berth", BERTH_VERSION}, {"backend", backend}, {"seed", report.seed}, {"flips", report.flips}};
  for (std::size_t i = 0; i < kChaosRegions; ++i) {
    Json& region = json["regions"][name_of(static_cast<ChaosRegion>(i))];
    for (const auto& [name, count] : kCounts) region[name] = report.regions[i].*count;
  }
  // Whole or not at all: a campaign may be stopped at any time.
  const std::string aside = file + ".part";
  write_file(aside, "the report", to_line(json) + '\n');
  std::filesystem::rename(aside, file);
}

/// What the file holds of the campaign asked for; empty where there is no file. Throws Error on another campaign's.
ChaosReport resume(const ChaosCommand& command) {
  ChaosReport report;
  report.seed = command.seed;
  if (command.file.empty() || !std::filesystem::exists(command.file)) return report;
  const std::string remedy = "give another --json file, or delete it";
  try {
    std::ifstream stream(command.file);
    const Json json = Json::parse(stream);
    if (json.at("seed") != command.seed || json.at("backend") != command.backend || json.at("berth") != BERTH_VERSION) {
      throw Error(command.file + ": it is of another campaign (seed, backend or version); " + remedy);
    }
    report.flips = json.at("flips");
    for (std::size_t i = 0; i < kChaosRegions; ++i) {
      const Json& region = json.at("regions").at(name_of(static_cast<ChaosRegion>(i)));
      for (const auto& [name, count] : kCounts) report.regions[i].*count = region.at(name);
    }
  } catch (const Json::exception& error) {
    throw Error(command.file + ": no report of berth chaos (" + error.what() + "); " + remedy);
  }
  return report;
}

void print_row(std::ostream& out, const char* name, const ChaosTally& t) {
  out << fmt::format("| {} ", name);
  for (const u64 count :
       {t.flips, t.masked, t.by_status, t.by_crash, t.by_scrub, t.by_known_answer, t.silent,
        t.wrong_pose + t.late_wrong_pose, t.in_lockstep, t.lockstep_late, t.lockstep_silent, t.lockstep_wrong_pose}) {
    out << fmt::format("| {} ", count);
  }
  out << "|\n";
}

/// Markdown, as docs/reliability.md has it.
void print(std::ostream& out, const ChaosReport& report) {
  out << "| region | flips | masked | alone: status | crash | scrub | answer | silent | wrong poses | lockstep: caught "
         "| late | silent | wrong poses |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (std::size_t i = 0; i < kChaosRegions; ++i) {
    print_row(out, name_of(static_cast<ChaosRegion>(i)), report.regions[i]);
  }
  print_row(out, "**all**", report.total());
}

class Progress {
 public:
  Progress(Console& console, const ChaosReport& report) : console_(console), first_(report.flips) {}

  void tell(const ChaosReport& report, u64 all) {
    const auto now = std::chrono::steady_clock::now();
    if (!console_.out_is_terminal() || now - told_ < kTellEvery) return;
    told_ = now;
    const double seconds = std::chrono::duration<double>(now - began_).count();
    const double rate = static_cast<double>(report.flips - first_) / seconds;
    console_.out() << fmt::format("\r{} of {} flips, {:.0f} a second, {:.0f} s to go\x1b[K", report.flips, all, rate,
                                  static_cast<double>(all - report.flips) / rate)
                   << std::flush;
  }
  void finish() {
    if (console_.out_is_terminal()) console_.out() << "\r\x1b[K";
  }

 private:
  Console& console_;
  const u64 first_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point told_ = began_;
};

int run_chaos(const ChaosCommand& command, Console& console) {
  ChaosReport report = resume(command);
  const std::unique_ptr<Backend> backend = open_backend(command.backend);
  ChaosCampaign campaign(*backend);
  const InterruptWatch interrupt;
  Progress progress(console, report);
  u64 saved = report.flips;
  console.out().flush();
  while (report.flips < command.flips && !interrupt.came()) {
    campaign.next(report, command.flips);
    if (report.flips >= saved + kSaveEvery) {
      save(command.file, command.backend, report);
      saved = report.flips;
    }
    progress.tell(report, command.flips);
  }
  progress.finish();
  save(command.file, command.backend, report);
  if (interrupt.came()) console.out() << "interrupted\n";
  print(console.out(), report);
  const ChaosTally all = report.total();
  console.out() << fmt::format("{} flips on {}, seed {}: with lockstep {} wrong poses that nobody saw on their frame\n",
                               report.flips, command.backend, report.seed, all.lockstep_wrong_pose);
  return all.lockstep_wrong_pose == 0 ? kOk : kNoResult;
}

}  // namespace

void add_chaos(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("chaos", "Turn over single bits in memory and count who notices");
  const auto options = std::make_shared<ChaosCommand>();
  command->add_option("--flips", options->flips, "how many, those in the file among them")
      ->type_name("N")
      ->check(CLI::Range(u64{1}, u64{1'000'000'000}))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "of the random numbers")->type_name("N")->capture_default_str();
  command->add_option("--backend", options->backend, "where the bits are: simd, cpu or reference")
      ->type_name("NAME")
      ->capture_default_str();
  command->add_option("--json", options->file, "the report for a machine; a campaign goes on where it ends")
      ->type_name("FILE");
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_chaos(*options, console); });
}

}  // namespace berth::cli
