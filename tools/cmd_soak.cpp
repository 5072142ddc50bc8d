// berth soak: random scenarios with random faults, for hours, and what must hold in every frame.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <sstream>

#include "commands.hpp"
#include "interrupt.hpp"
#include "output_file.hpp"
#include "soak_report.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth soak --scenarios 20
  berth soak --hours 8 --state soak.json         goes on where the file ends, killed or not
  berth soak --seed 7 --scenario 1234            one scenario again, with what it is

Every scenario is a simulated camera with faults, searched as berth run would (docs/reliability.md). The exit code is 1
where something that must hold did not; the report says what, and the command that repeats it.)";

constexpr std::chrono::seconds kTellEvery{10};

struct SoakCommand {
  double hours = 0;
  u64 scenarios = 0;
  u64 seed = 1;
  std::string state, report;
};

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

void save(const SoakCommand& command, const SoakReport& report) {
  if (command.state.empty()) return;
  // Whole or not at all: it may be killed at any time.
  const std::string aside = command.state + ".part";
  write_file(aside, "the state", to_line(to_json(report)) + '\n');
  std::filesystem::rename(aside, command.state);
}

class Soak {
 public:
  Soak(const SoakCommand& command, Console& console) : command_(command), console_(console) {
    report_.seed = command.seed;
    if (!command.state.empty() && std::filesystem::exists(command.state)) {
      report_ = read_soak_report(command.state, command.seed);
    }
    report_.begin_run();
  }

  int run() {
    const InterruptWatch interrupt;
    console_.out() << fmt::format("from scenario {} of seed {}\n", report_.next, report_.seed) << std::flush;
    while (!is_done()) {
      const auto began = Clock::now();
      const SoakScenario scenario = draw_scenario(report_.seed, report_.next, backends_.names());
      const SoakOutcome outcome = run_scenario(scenario, backends_);
      if (outcome.interrupted || interrupt.came()) {
        console_.out() << "interrupted\n";
        break;
      }
      const u64 before = report_.violation_count;
      report_.add(outcome, seconds_since(began), memory_now());
      save(command_, report_);
      tell(scenario, report_.violation_count - before);
    }
    print(console_.out(), report_);
    if (!command_.report.empty()) {
      std::ostringstream text;
      print(text, report_);
      write_file(command_.report, "the report", text.str());
    }
    return report_.violation_count == 0 ? kOk : kNoResult;
  }

 private:
  bool is_done() const {
    if (command_.hours > 0 && report_.seconds >= command_.hours * 3600) return true;
    return command_.scenarios > 0 && report_.next >= command_.scenarios;
  }

  /// A violation at once, the progress now and then.
  void tell(const SoakScenario& scenario, u64 violations) {
    for (std::size_t i = report_.violations.size() - std::min<u64>(violations, report_.violations.size());
         i < report_.violations.size(); ++i) {
      const SoakViolation& violation = report_.violations[i];
      console_.out() << fmt::format("violation: {}; {} ({})\n", violation.what, command_of(report_, violation),
                                    scenario.describe())
                     << std::flush;
    }
    if (Clock::now() - told_ < kTellEvery) return;
    told_ = Clock::now();
    double done = command_.hours > 0 ? report_.seconds / (command_.hours * 3600) : 0;
    if (command_.scenarios > 0) {
      done = std::max(done, static_cast<double>(report_.next) / static_cast<double>(command_.scenarios));
    }
    console_.out() << fmt::format("{} scenarios, {} frames, {} violations; {:.0f} s, {:.0f} s to go\n", report_.next,
                                  report_.tally.frames, report_.violation_count, report_.seconds,
                                  report_.seconds * (1 - done) / std::max(done, 1e-9))
                   << std::flush;
  }

  const SoakCommand& command_;
  Console& console_;
  const SoakBackends backends_;
  SoakReport report_;
  Clock::time_point told_ = Clock::now();
};

int run_one(const SoakCommand& command, u64 number, Console& console) {
  const SoakBackends backends;
  const SoakScenario scenario = draw_scenario(command.seed, number, backends.names());
  console.out() << fmt::format("scenario {} of seed {}: {}\n{}", number, command.seed, scenario.describe(),
                               scenario.toml)
                << std::flush;
  const InterruptWatch interrupt;
  SoakReport report;
  report.seed = command.seed;
  report.next = number;
  report.begin_run();
  const auto began = Clock::now();
  const SoakOutcome outcome = run_scenario(scenario, backends);
  report.add(outcome, seconds_since(began), memory_now());
  print(console.out(), report);
  return outcome.violations.empty() ? kOk : kNoResult;
}

}  // namespace

void add_soak(CLI::App& app, Console& console, int& exit_code) {
  struct Options {
    SoakCommand command;
    u64 scenario = 0;
  };
  CLI::App* command = app.add_subcommand("soak", "Random scenarios with random faults, for hours; what must hold does");
  const auto options = std::make_shared<Options>();
  SoakCommand& soak = options->command;
  CLI::Option* hours = command->add_option("--hours", soak.hours, "for so long, earlier runs of the state among it")
                           ->type_name("N")
                           ->check(CLI::Range(0.0, 1e5));
  CLI::Option* scenarios = command->add_option("--scenarios", soak.scenarios, "so many, those of the state among them")
                               ->type_name("N")
                               ->check(CLI::Range(u64{1}, u64{1'000'000'000}));
  command->add_option("--seed", soak.seed, "of the random numbers")->type_name("N")->capture_default_str();
  CLI::Option* one = command->add_option("--scenario", options->scenario, "this one alone")
                         ->type_name("K")
                         ->excludes(hours)
                         ->excludes(scenarios);
  command->add_option("--state", soak.state, "what it came to so far, JSON; it goes on where that ends")
      ->type_name("FILE")
      ->excludes(one);
  command->add_option("--report", soak.report, "the report at the end, Markdown")->type_name("FILE")->excludes(one);
  command->footer(kExamples);
  command->callback([options, one, hours, scenarios, &console, &exit_code] {
    SoakCommand& asked = options->command;
    if (one->count() > 0) {
      exit_code = run_one(asked, options->scenario, console);
      return;
    }
    if (hours->count() + scenarios->count() == 0) asked.scenarios = 20;
    exit_code = Soak(asked, console).run();
  });
}

}  // namespace berth::cli
