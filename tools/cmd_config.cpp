// berth config: what a configuration file of `berth run` may have in it.
#include <CLI/App.hpp>

#include "berth/error.hpp"
#include "commands.hpp"
#include "run_config.hpp"

namespace berth::cli {

void add_config(CLI::App& app, Console& console) {
  CLI::App* command = app.add_subcommand("config", "Explain the configuration file of berth run");
  command->add_flag("--explain", "every key with its meaning, unit or kind, bounds and default, as a TOML file")
      ->required();
  command->footer("Examples:\n  berth config --explain >berth.toml    then edit, and: berth run --config berth.toml");
  command->callback([&app, &console] { console.out() << explain_config(*app.get_subcommand("run")); });
}

}  // namespace berth::cli
