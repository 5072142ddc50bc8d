#pragma once

#include <cstdio>
#include <string>
#include <utility>

namespace berth::test {

/// What a command of the shell prints, and its exit status.
inline std::pair<std::string, int> output_of(const std::string& command) {
  std::FILE* output = popen(command.c_str(), "r");
  std::string text;
  char part[4096];
  while (std::fgets(part, sizeof part, output) != nullptr) text += part;
  return {text, pclose(output)};
}

}  // namespace berth::test
