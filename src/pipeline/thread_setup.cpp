#include "pipeline/thread_setup.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstring>
#include <string>

#include "berth/error.hpp"

namespace berth {
namespace {

/// "0, 1, 5": what the process may use.
std::string usable_cores() {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  std::string text;
  if (sched_getaffinity(0, sizeof cores, &cores) != 0) return "none that can be told";
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (CPU_ISSET(core, &cores)) text += (text.empty() ? "" : ", ") + std::to_string(core);
  }
  return text;
}

}  // namespace

void pin_to_core(int core) {
  const std::string remedy = "; give some of " + usable_cores();
  if (core < 0 || core >= CPU_SETSIZE) throw Error("core " + std::to_string(core) + " does not exist" + remedy);
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core, &cores);
  const int error = pthread_setaffinity_np(pthread_self(), sizeof cores, &cores);
  if (error != 0) {
    throw Error("core " + std::to_string(core) + " cannot be used (" + std::strerror(error) + ")" + remedy);
  }
}

void make_realtime(int priority) {
  sched_param parameters = {};
  parameters.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (error == 0) return;
  throw Error("real-time priority " + std::to_string(priority) + " cannot be had (" + std::strerror(error) +
              "); allow it by `ulimit -r 99` (rtprio in /etc/security/limits.conf), by CAP_SYS_NICE (setcap "
              "cap_sys_nice+ep on the program, --cap-add sys_nice for a container), or run without");
}

void make_ordinary() {
  const sched_param parameters = {};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &parameters);
}

void make_background() {
  make_ordinary();
  // Where the process stands back further already, there is nothing to do.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), 10);
}

void name_thread(const char* name) { pthread_setname_np(pthread_self(), name); }

}  // namespace berth
