#include <unistd.h>

#include <iostream>

#include "console.hpp"

int main(int argc, char** argv) {
  std::ios::sync_with_stdio(false);
  berth::cli::Console console(std::cout, std::cerr, isatty(STDOUT_FILENO) != 0);
  return berth::cli::run_command(argc, argv, console);
}
