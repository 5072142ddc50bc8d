#pragma once

#include <CLI/App.hpp>
#include <functional>

#include "console.hpp"

namespace berth::cli {

struct RunOptions;

/// What another has to say of a run's options, once they are checked and before anything is opened.
using RunPart = std::function<void(RunOptions&)>;

/// Each adds one subcommand, whose callback runs it and leaves its exit code in `exit_code`.
void add_calibrate(CLI::App& app, Console& console, int& exit_code);
void add_chaos(CLI::App& app, Console& console, int& exit_code);
void add_demo(CLI::App& app, Console& console, int& exit_code);
void add_detect(CLI::App& app, Console& console, int& exit_code);
void add_flight(CLI::App& app, Console& console, int& exit_code);
void add_plan(CLI::App& app, Console& console, int& exit_code);
void add_print_tag(CLI::App& app, Console& console, int& exit_code);
void add_recover(CLI::App& app, Console& console, int& exit_code);
void add_replay(CLI::App& app, Console& console, int& exit_code);
void add_run(CLI::App& app, Console& console, int& exit_code, const RunPart& part = {});
void add_soak(CLI::App& app, Console& console, int& exit_code);
void add_stations(CLI::App& app, Console& console, int& exit_code);
void add_survey(CLI::App& app, Console& console, int& exit_code);
void add_table(CLI::App& app, Console& console, int& exit_code);
void add_verify(CLI::App& app, Console& console, int& exit_code);
void add_view(CLI::App& app, Console& console, int& exit_code);
void add_bench(CLI::App& app, Console& console, int& exit_code);
void add_eval(CLI::App& app, Console& console, int& exit_code);
void add_model(CLI::App& app, Console& console, int& exit_code);
void add_doctor(CLI::App& app, Console& console, int& exit_code);
/// Explains the subcommand `run`.
void add_config(CLI::App& app, Console& console);

}  // namespace berth::cli
