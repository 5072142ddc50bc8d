#pragma once

#include <net/if.h>
#include <sched.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace berth::test {

/// Gives this process a network of its own, in which port 3956 of 127.0.0.1 is free whatever else is tested on the
/// machine; leaves it where it is if the kernel does not let it. Before there is a second thread.
inline void enter_own_network() {
  if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return;
  const int control = socket(AF_INET, SOCK_DGRAM, 0);
  ifreq request = {};
  std::strcpy(request.ifr_name, "lo");
  request.ifr_flags = IFF_UP;
  if (ioctl(control, SIOCSIFFLAGS, &request) != 0) throw std::runtime_error("lo cannot be brought up");
  close(control);
}

/// A fake_gige_camera at work; it ends as if its power was cut.
class FakeGigeProcess {
 public:
  explicit FakeGigeProcess(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), BERTH_FAKE_GIGE_CAMERA);
    std::array<int, 2> in = {}, out = {};
    if (pipe(in.data()) != 0 || pipe(out.data()) != 0) throw std::runtime_error("no pipe");
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    child_ = fork();
    if (child_ == 0) {
      dup2(in[0], STDIN_FILENO);
      dup2(out[1], STDOUT_FILENO);
      close(in[1]);  // or it would keep its own input open
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(in[0]);
    close(out[1]);
    input_ = in[1];
    char first = 0;
    const bool is_ready = read(out[0], &first, 1) == 1;
    close(out[0]);
    if (!is_ready) throw std::runtime_error("the fake camera does not run; what it said is above");
  }
  ~FakeGigeProcess() {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
    close(input_);
  }
  FakeGigeProcess(const FakeGigeProcess&) = delete;
  FakeGigeProcess& operator=(const FakeGigeProcess&) = delete;

 private:
  pid_t child_ = -1;
  int input_ = -1;
};

}  // namespace berth::test
