#include <unistd.h>

#include <csignal>
#include <iostream>

#include "console.hpp"

int main(int argc, char** argv) {
  // A limit of file sizes is an error of the file at hand, as a full disk is, and not the end of the program.
  std::signal(SIGXFSZ, SIG_IGN);
  std::ios::sync_with_stdio(false);
  berth::cli::Console console(std::cout, std::cerr, isatty(STDOUT_FILENO) != 0);
  return berth::cli::run_command(argc, argv, console);
}
