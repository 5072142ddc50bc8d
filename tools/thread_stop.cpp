#include "thread_stop.hpp"

#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>

namespace berth::cli {
namespace {

constexpr long kStopNs = 100'000'000;

void sleep_here(int) {
  const int before = errno;
  timespec left = {0, kStopNs};
  while (nanosleep(&left, &left) != 0 && errno == EINTR) {
  }
  errno = before;
}

}  // namespace

bool stop_thread(const char* name) {
  struct sigaction action = {};
  action.sa_handler = sleep_here;
  action.sa_flags = SA_RESTART;
  sigaction(SIGUSR2, &action, nullptr);
  bool found = false;
  std::error_code ignored;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", ignored)) {
    std::string comm;
    std::ifstream(task.path() / "comm") >> comm;
    if (comm != name) continue;
    found = syscall(SYS_tgkill, getpid(), std::stoi(task.path().filename()), SIGUSR2) == 0 || found;
  }
  return found;
}

}  // namespace berth::cli
