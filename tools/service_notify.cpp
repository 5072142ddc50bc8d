// The protocol is that of sd_notify(3), which promises that it stays: datagrams of NAME=VALUE to a Unix socket.
#include "service_notify.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>

#include "berth/error.hpp"

namespace berth::cli {
namespace {

constexpr auto kPause = std::chrono::milliseconds(100);

class ServiceNotify : public FrameObserver {
 public:
  explicit ServiceNotify(const std::string& name) {
    if (name.size() < 2 || (name[0] != '/' && name[0] != '@') || name.size() >= sizeof address_.sun_path) {
      throw Error("NOTIFY_SOCKET is '" + name +
                  "'; it is a path, or a name with @ before it, of 107 bytes at most: leave it to the service manager");
    }
    address_.sun_family = AF_UNIX;
    std::memcpy(address_.sun_path, name.data(), name.size());
    if (name[0] == '@') address_.sun_path[0] = 0;
    length_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket_ < 0) throw Error(std::string("NOTIFY_SOCKET: no socket can be made: ") + std::strerror(errno));
  }
  ~ServiceNotify() override { close(socket_); }
  ServiceNotify(const ServiceNotify&) = delete;
  ServiceNotify& operator=(const ServiceNotify&) = delete;

  void observe(const ObservedFrame&) override {
    const auto now = std::chrono::steady_clock::now();
    if (is_ready_ && now - told_ < kPause) return;
    told_ = now;
    say(is_ready_ ? "WATCHDOG=1" : "READY=1\nWATCHDOG=1");
    is_ready_ = true;
  }
  void finish(std::ostream&) override { say("STOPPING=1"); }

 private:
  /// Never waits. A manager that does not read misses a message, and the next one tells it.
  void say(const char* text) {
    sendto(socket_, text, std::strlen(text), MSG_DONTWAIT | MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address_),
           length_);
  }

  int socket_ = -1;
  sockaddr_un address_ = {};
  socklen_t length_ = 0;
  bool is_ready_ = false;
  std::chrono::steady_clock::time_point told_;
};

}  // namespace

std::unique_ptr<FrameObserver> service_notify() {
  const char* name = std::getenv("NOTIFY_SOCKET");
  if (name == nullptr || *name == 0) return nullptr;
  return std::make_unique<ServiceNotify>(name);
}

}  // namespace berth::cli
