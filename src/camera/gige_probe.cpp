#include "camera/gige_probe.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

#include "berth/types.hpp"

namespace berth {
namespace {

constexpr int kControlPort = 3956;
// GigE Vision 2.0, 15.1: the key, "acknowledge", DISCOVERY_CMD, no data, request 1; and what answers it.
constexpr std::array<u8, 8> kDiscovery = {0x42, 0x01, 0, 0x02, 0, 0, 0, 1};
constexpr u8 kDiscoveryAck = 0x03;

class Socket {
 public:
  Socket() : file_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (file_ >= 0) close(file_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int file() const { return file_; }

 private:
  int file_;
};

}  // namespace

bool answers_gige(const std::string& address, int timeout_ms) {
  sockaddr_in camera = {};
  camera.sin_family = AF_INET;
  camera.sin_port = htons(kControlPort);
  if (inet_pton(AF_INET, address.c_str(), &camera.sin_addr) != 1) return false;
  const Socket socket;
  // Connected, so that what others send is not taken for the answer, and a closed port is told at once.
  if (connect(socket.file(), reinterpret_cast<const sockaddr*>(&camera), sizeof camera) != 0) return false;
  if (send(socket.file(), kDiscovery.data(), kDiscovery.size(), MSG_NOSIGNAL) < 0) return false;
  pollfd ready = {socket.file(), POLLIN, 0};
  if (poll(&ready, 1, timeout_ms) != 1) return false;
  std::array<u8, 1024> answer = {};
  const ssize_t bytes = recv(socket.file(), answer.data(), answer.size(), 0);
  return bytes >= 8 && answer[3] == kDiscoveryAck;
}

}  // namespace berth
