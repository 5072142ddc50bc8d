#include "web_connection.hpp"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>

namespace berth::cli {
namespace {

using std::chrono::milliseconds;

/// What the kernel may hold for a viewer that is slow: the less, the newer is what it sees.
constexpr int kSendBuffer = 128 * 1024;

bool wait_for(int socket, short what, milliseconds time) {
  pollfd one = {socket, what, 0};
  int ready = 0;
  do {
    ready = poll(&one, 1, static_cast<int>(std::max<milliseconds::rep>(0, time.count())));
  } while (ready < 0 && errno == EINTR);
  return ready > 0;
}

}  // namespace

WebConnection::WebConnection(int socket, std::size_t most) : socket_(socket), left_(most) {
  setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
}

WebConnection::~WebConnection() {
  // Closed with something unread, the connection would be reset, and the answer lost on its way.
  ::shutdown(socket_, SHUT_WR);
  std::array<char, 4096> rest;
  for (int i = 0; i < 16 && wait_for(socket_, POLLIN, milliseconds(is_refused_ ? 0 : 20)); ++i) {
    if (recv(socket_, rest.data(), rest.size(), MSG_DONTWAIT) <= 0) break;
  }
  ::close(socket_);
}

void WebConnection::refuse() {
  static constexpr char kAnswer[] =
      "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nRetry-After: 5\r\nContent-Type: text/plain\r\n"
      "Content-Length: 38\r\n\r\ntoo many connections; try again later\n";
  is_refused_ = true;
  // On the thread that accepts: whoever cannot take it at once goes without.
  [[maybe_unused]] const ssize_t gone = send(socket_, kAnswer, sizeof kAnswer - 1, MSG_NOSIGNAL | MSG_DONTWAIT);
}

bool WebConnection::is_readable() const { return at_ < filled_ || wait_for(socket_, POLLIN, milliseconds(0)); }

bool WebConnection::is_writable() const { return wait_for(socket_, POLLOUT, kStalled); }

ssize_t WebConnection::read(char* to, std::size_t size) {
  if (at_ == filled_) {
    const auto time = std::chrono::duration_cast<milliseconds>(due_ - std::chrono::steady_clock::now());
    if (left_ == 0 || !wait_for(socket_, POLLIN, time)) return -1;
    const ssize_t came = recv(socket_, buffer_.data(), std::min(buffer_.size(), left_), MSG_DONTWAIT);
    if (came <= 0) return came;
    left_ -= static_cast<std::size_t>(came);
    at_ = 0;
    filled_ = static_cast<std::size_t>(came);
  }
  const std::size_t taken = std::min(size, filled_ - at_);
  std::copy_n(buffer_.data() + at_, taken, to);
  at_ += taken;
  return static_cast<ssize_t>(taken);
}

ssize_t WebConnection::write(const char* from, std::size_t size) {
  while (true) {
    if (!wait_for(socket_, POLLOUT, kStalled)) return -1;
    const ssize_t gone = send(socket_, from, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (gone >= 0 || (errno != EAGAIN && errno != EINTR)) return gone;
  }
}

void WebConnection::name_end(bool is_remote, std::string& ip, int& port) const {
  sockaddr_storage end = {};
  socklen_t size = sizeof end;
  sockaddr* any = reinterpret_cast<sockaddr*>(&end);
  if ((is_remote ? getpeername(socket_, any, &size) : getsockname(socket_, any, &size)) != 0) return;
  std::array<char, NI_MAXHOST> host = {};
  std::array<char, NI_MAXSERV> service = {};
  if (getnameinfo(any, size, host.data(), host.size(), service.data(), service.size(),
                  NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
    return;
  }
  ip = host.data();
  port = std::atoi(service.data());
}

}  // namespace berth::cli
