#pragma once

#include <atomic>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "console.hpp"
#include "interrupt.hpp"
#include "support/scratch_folder.hpp"

namespace berth::test {

inline std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// What a run of the command left behind.
struct CommandRun {
  int exit_code = -1;
  std::string out, err;

  /// Standard output, every line of which must be JSON; a line that is not becomes `discarded` and fails comparisons.
  std::vector<nlohmann::json> lines() const { return json_lines(out); }

  static std::vector<nlohmann::json> json_lines(const std::string& text) {
    std::vector<nlohmann::json> parsed;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) parsed.push_back(nlohmann::json::parse(line, nullptr, false));
    return parsed;
  }
};

/// `berth ARGUMENTS…` in this process.
inline CommandRun run_berth(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "berth");
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  std::ostringstream out, err;
  cli::Console console(out, err, false);
  CommandRun run;
  run.exit_code = cli::run_command(static_cast<int>(argv.size()), argv.data(), console);
  run.out = out.str();
  run.err = err.str();
  return run;
}

/// One that ends by Ctrl-C alone.
inline CommandRun run_berth_until_interrupted(std::vector<std::string> arguments) {
  std::atomic<bool> is_over = false;
  std::thread interrupt([&] {
    // What comes before the command listens is lost.
    while (!is_over) {
      cli::InterruptWatch::ask();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  CommandRun run = run_berth(std::move(arguments));
  is_over = true;
  interrupt.join();
  return run;
}

}  // namespace berth::test
