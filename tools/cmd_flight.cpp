// berth flight: from the first sight of the target to its marker, in simulation; one flight in pictures, or many.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

#include "berth/error.hpp"
#include "commands.hpp"
#include "flight_run.hpp"
#include "flight_show.hpp"
#include "output_file.hpp"

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  berth flight                                     one flight: flight.svg, flight.png, flight.jsonl
  berth flight --seed 7 --backend vulkan
  berth flight --fps 30 --frames 300 --nav-backend opencl    in real time, the network on another backend
  berth flight --count 1000 --jobs 2 --out flights     a campaign; the same command again goes on with it

A flight goes from 6 m to 0.15 m before the marker. All of it is a function of its seed.)";

struct FlightCommand : FlightOptions {
  int count = 1;
  int jobs = 1;
  bool empty = false;
};

/// The lines of earlier flights; one cut off in the middle does not count.
std::vector<Json> read_lines(const fs::path& path) {
  std::vector<Json> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    Json parsed = Json::parse(line, nullptr, false);
    if (!parsed.is_discarded()) lines.push_back(std::move(parsed));
  }
  return lines;
}

/// Of flights without a target.
void sum_up_alarms(const std::vector<Json>& flights, Console& console) {
  long frames = 0;
  long sightings = 0;
  int believed = 0;
  for (const Json& flight : flights) {
    frames += flight.at("frames").get<long>();
    sightings += flight.at("sightings").get<long>();
    believed += flight.at("changes").empty() ? 0 : 1;
  }
  console.out() << fmt::format(
      "\n| flights without target | frames | false alarms per 1,000 frames | flights with one believed |\n"
      "|---|---|---|---|\n| {} | {} | {:.2f} | {} |\n",
      flights.size(), frames, 1000.0 * static_cast<double>(sightings) / static_cast<double>(std::max(1L, frames)),
      believed);
}

void sum_up(const std::vector<Json>& flights, Console& console) {
  int docked = 0;
  int gaps = 0;
  int wrong = 0;
  int longest = 0;
  std::size_t changes = 0;
  for (const Json& flight : flights) {
    docked += flight.at("docked").get<bool>() ? 1 : 0;
    gaps += flight.at("longest_gap").get<int>() > 3 ? 1 : 0;
    wrong += flight.at("wrong").get<int>() > 0 ? 1 : 0;
    longest = std::max(longest, flight.at("longest_gap").get<int>());
    changes += flight.at("changes").size();
  }
  console.out() << fmt::format(
      "\n| flights | docked | gap over 3 frames | longest gap | something else for the target | changes of mode each "
      "|\n"
      "|---|---|---|---|---|---|\n| {} | {} | {} | {} | {} | {:.2f} |\n",
      flights.size(), docked, gaps, longest, wrong,
      static_cast<double>(changes) / static_cast<double>(std::max<std::size_t>(1, flights.size())));
}

/// Flights by seed, several at a time; a line is written as each one ends.
class Campaign {
 public:
  Campaign(const FlightCommand& command, Console& console)
      : command_(command),
        console_(console),
        path_((fs::path(command.out) / (command.empty ? "empty.jsonl" : "flights.jsonl")).string()),
        flights_(read_lines(path_)) {
    std::set<std::uint64_t> flown;
    std::string whole;  // lines only, before more are added
    for (const Json& flight : flights_) {
      flown.insert(flight.at("seed").get<std::uint64_t>());
      whole += to_line(flight) + "\n";
    }
    write_file(path_, "the log", whole);
    file_.open(path_, std::ios::binary | std::ios::app);
    for (int k = 0; k < command.count; ++k) {
      const std::uint64_t seed = command.seed + static_cast<std::uint64_t>(k);
      if (flown.count(seed) == 0) seeds_.push_back(seed);
    }
    all_ = flights_.size() + seeds_.size();
  }

  /// Returns every flight in the log. Throws Error.
  const std::vector<Json>& run() {
    std::vector<std::thread> crews;
    for (int k = 0; k < command_.jobs; ++k) crews.emplace_back([this] { work(); });
    for (std::thread& crew : crews) crew.join();
    if (!failure_.empty()) throw Error(failure_);
    if (!file_) throw Error(path_ + ": writing failed; check the disk's space");
    return flights_;
  }
  const std::string& path() const { return path_; }

 private:
  void work() {
    try {
      for (std::size_t k = next_++; k < seeds_.size(); k = next_++) add(flown(seeds_[k]));
    } catch (const std::exception& error) {
      const std::lock_guard<std::mutex> lock(mutex_);
      failure_ = error.what();
      next_ = seeds_.size();
    }
  }
  Json flown(std::uint64_t seed) const {
    // A new pilot each: nothing of one flight may reach the next.
    const Crew crew(command_);
    return to_json(fly(navset::Flight(seed, command_.frames, !command_.empty), seed, *crew.pilot));
  }
  void add(Json flight) {
    const std::lock_guard<std::mutex> lock(mutex_);
    file_ << to_line(flight) << '\n' << std::flush;
    flights_.push_back(std::move(flight));
    const bool terminal = console_.out_is_terminal();
    if (!terminal && flights_.size() % 20 != 0) return;
    console_.out() << fmt::format("{}{} of {} flights{}", terminal ? "\r" : "", flights_.size(), all_,
                                  terminal ? "\x1b[K" : "\n")
                   << std::flush;
  }

  const FlightCommand& command_;
  Console& console_;
  std::string path_;
  std::vector<Json> flights_;
  std::vector<std::uint64_t> seeds_;
  std::size_t all_ = 0;
  std::ofstream file_;
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::string failure_;
};

int fly_many(const FlightCommand& command, Console& console) {
  make_folder(command.out, "name another by --out");
  Campaign campaign(command, console);
  const std::vector<Json>& flights = campaign.run();
  console.out() << "log         " << campaign.path() << '\n';
  if (command.empty) {
    sum_up_alarms(flights, console);
    return kOk;
  }
  sum_up(flights, console);
  const bool all =
      std::all_of(flights.begin(), flights.end(), [](const Json& flight) { return flight.at("docked").get<bool>(); });
  return all ? kOk : kNoResult;
}

}  // namespace

void add_flight(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("flight", "Watch simulated flights from 6 m to the docked marker");
  const auto options = std::make_shared<FlightCommand>();
  options->out = "berth-flight";
  add_flight_options(*command, *options);
  command->add_option("--count", options->count, "flights; more than one write a line each and no pictures")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command->add_option("--jobs", options->jobs, "flights at a time")->check(CLI::Range(1, 256))->capture_default_str();
  command->add_flag("--empty", options->empty, "without the target: how often something else is taken for it");
  command->add_option("--out", options->out, "folder for logs and pictures")->type_name("DIR")->capture_default_str();
  command
      ->add_option("--known-answer", options->known_answer_s,
                   "with --fps: at start and every so many seconds pictures with known answers, for marker and network "
                   "each, memory checked all the while (docs/reliability.md); 0 for none")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] {
    if (options->pace.fps != 0 && (options->count != 1 || options->empty)) {
      throw Error("--fps plays one flight; leave --count and --empty out");
    }
    if (options->known_answer_s > 0 && options->pace.fps == 0) {
      throw Error("--known-answer is for flights that are played; give --fps, too");
    }
    exit_code = options->count == 1 && !options->empty ? show_flight(*options, console) : fly_many(*options, console);
  });
}

}  // namespace berth::cli
