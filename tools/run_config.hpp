#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace berth::cli {

/// A configuration of `berth run` is a TOML file whose keys are the command's options without their dashes
/// (docs/configuration.md).
///
/// `arguments` (without the program's name) with those that its --config FILE stands for put in where the command
/// begins; options that are given beside it are left out of the file's. Without --config they come back as they are.
/// Throws Error naming file, line, key, value and remedy for a key that is no option, or a value that cannot be one's.
std::vector<std::string> with_config(const CLI::App& run, std::vector<std::string> arguments);

/// The arguments that one table of a file of several stands for: `section`'s, or for "" those at its top, beside which
/// `sections` are. Options that `command` was given already are left out. `help`: where all keys are listed. Throws
/// Error as with_config, and where the section is missing.
std::vector<std::string> section_arguments(const std::string& path, const CLI::App& command, const std::string& section,
                                           const std::vector<std::string>& sections, const std::string& help);

/// Every key, as a TOML file of comments: what it is, its unit or kind, bounds and default.
std::string explain_config(const CLI::App& run);

}  // namespace berth::cli
