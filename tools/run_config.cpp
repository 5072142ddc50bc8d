#include "run_config.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "berth/error.hpp"
#include "near_names.hpp"

namespace berth::cli {
namespace {

bool is_flag(const CLI::Option& option) { return option.get_items_expected_max() == 0; }

/// What can stand in a file: each long option but those that are about the command line itself.
std::vector<const CLI::Option*> keys_of(const CLI::App& run) {
  std::vector<const CLI::Option*> keys;
  for (const CLI::Option* option : run.get_options()) {
    const std::vector<std::string>& names = option->get_lnames();
    if (!names.empty() && names.front() != "help" && names.front() != "config") keys.push_back(option);
  }
  return keys;
}

const std::string& name_of(const CLI::Option& option) { return option.get_lnames().front(); }

/// One file, and how it says what is wrong.
class ConfigFile {
 public:
  explicit ConfigFile(const std::string& path) : path_(path) {
    std::ifstream stream(path, std::ios::binary);
    std::ostringstream text;
    if (!stream || !(text << stream.rdbuf())) {
      throw Error(path + ": the configuration cannot be read; name a TOML file that is there and not empty");
    }
    try {
      table_ = toml::parse(text.str(), path);
    } catch (const toml::parse_error& error) {
      throw Error(fmt::format("{}:{}: not TOML: {}; see https://toml.io for the syntax", path,
                              error.source().begin.line, error.description()));
    }
  }

  /// The arguments of every key that is not among `given`.
  std::vector<std::string> arguments(const CLI::App& run, const std::set<const CLI::Option*>& given) const {
    return arguments_of(table_, run, given, {}, "berth config --explain");
  }

  /// The same of one section, or of what stands beside all of them.
  std::vector<std::string> section_arguments(const CLI::App& command, const std::set<const CLI::Option*>& given,
                                             const std::string& section, const std::vector<std::string>& sections,
                                             const std::string& help) const {
    if (section.empty()) return arguments_of(table_, command, given, sections, help);
    const toml::table* table = table_[section].as_table();
    if (table == nullptr)
      throw Error(path_ + ": the section [" + section + "] is missing; " + help + " has an example");
    return arguments_of(*table, command, given, {}, help);
  }

 private:
  std::vector<std::string> arguments_of(const toml::table& table, const CLI::App& run,
                                        const std::set<const CLI::Option*>& given,
                                        const std::vector<std::string>& sections, const std::string& help) const {
    const std::vector<const CLI::Option*> keys = keys_of(run);
    std::vector<std::string> all;
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      if (std::find(sections.begin(), sections.end(), name) != sections.end()) continue;
      const auto is_named = [&](const CLI::Option* option) { return name_of(*option) == name; };
      const auto found = std::find_if(keys.begin(), keys.end(), is_named);
      if (found == keys.end()) {
        std::vector<std::string> known = sections;
        for (const CLI::Option* option : keys) known.push_back(name_of(*option));
        fail(node, name, "is unknown; did you mean '" + near_names(name, known, 1) + "'? " + help + " lists all keys");
      }
      if (given.count(*found) == 0) add(**found, name, node, all);
    }
    return all;
  }

  [[noreturn]] void fail(const toml::node& node, const std::string& key, const std::string& what) const {
    throw Error(fmt::format("{}:{}: field '{}' {}", path_, node.source().begin.line, key, what));
  }

  void add(const CLI::Option& option, const std::string& key, const toml::node& node,
           std::vector<std::string>& arguments) const {
    if (is_flag(option)) {
      if (!node.is_boolean()) fail(node, key, "switches something on; give true or false");
      if (node.as_boolean()->get()) arguments.push_back("--" + key);
      return;
    }
    const toml::array* array = node.as_array();
    if (array == nullptr) {
      arguments.push_back("--" + key + "=" + text_of(node, key));
      return;
    }
    if (option.get_items_expected_max() <= 1) fail(node, key, "is an array; give one value");
    for (const toml::node& element : *array) arguments.push_back("--" + key + "=" + text_of(element, key));
  }

  std::string text_of(const toml::node& node, const std::string& key) const {
    if (const auto* value = node.as_string()) return value->get();
    if (const auto* value = node.as_integer()) return fmt::format("{}", value->get());
    if (const auto* value = node.as_floating_point()) return fmt::format("{}", value->get());
    if (node.is_table()) fail(node, key, "is a table; keys stand at the top of the file, without [sections]");
    fail(node, key, "is neither a text nor a number; give one");
  }

  std::string path_;
  toml::table table_;
};

std::string in_quotes(const std::string& text) { return '"' + text + '"'; }

/// "[14.3,33]", "4" or "edges" as TOML has them.
std::string toml_value(const CLI::Option& option) {
  if (is_flag(option)) return "false";
  const std::string value = option.get_default_str();
  if (value.empty()) return "";
  char* end = nullptr;
  std::strtod(value.c_str(), &end);
  return *end == 0 || value[0] == '[' ? value : in_quotes(value);
}

}  // namespace

std::vector<std::string> with_config(const CLI::App& run, std::vector<std::string> arguments) {
  if (arguments.empty() || arguments.front() != run.get_name()) return arguments;
  std::string path;
  std::set<const CLI::Option*> given;
  for (std::size_t i = 1; i < arguments.size() && arguments[i] != "--"; ++i) {
    const std::size_t equals = arguments[i].find('=');
    const std::string name = arguments[i].substr(0, equals);
    if (name.empty() || name[0] != '-') continue;
    if (name != "--config") {
      given.insert(run.get_option_no_throw(name));
    } else if (equals != std::string::npos) {
      path = arguments[i].substr(equals + 1);
    } else if (i + 1 < arguments.size()) {
      path = arguments[++i];
    }
  }
  if (path.empty()) return arguments;
  const std::vector<std::string> more = ConfigFile(path).arguments(run, given);
  arguments.insert(arguments.begin() + 1, more.begin(), more.end());
  return arguments;
}

std::vector<std::string> section_arguments(const std::string& path, const CLI::App& command, const std::string& section,
                                           const std::vector<std::string>& sections, const std::string& help) {
  std::set<const CLI::Option*> given;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() > 0) given.insert(option);
  }
  return ConfigFile(path).section_arguments(command, given, section, sections, help);
}

std::string explain_config(const CLI::App& run) {
  std::string text =
      "# A configuration for `berth run --config FILE`: every key, with its unit or kind, bounds and default. Keys are "
      "the\n"
      "# command's options; what is given on the command line comes before what is here. Paths are relative to where\n"
      "# berth is started.\n";
  for (const CLI::Option* option : keys_of(run)) {
    text += "\n# " + option->get_description() + "\n#";
    if (is_flag(*option)) {
      text += " true or false";
    } else {
      text += " " + option->get_type_name();
      if (option->get_items_expected_max() > 1) text += "; one, or several in an array";
    }
    if (option->get_required()) text += "; required";
    for (const CLI::Option* other : option->get_needs()) text += "; needs " + name_of(*other);
    if (option->get_group() != "Options") text += "; under " + in_quotes(option->get_group());
    const std::string value = toml_value(*option);
    text += "\n# " + name_of(*option) + " =" + (value.empty() ? "" : " " + value) + "\n";
  }
  return text;
}

}  // namespace berth::cli
