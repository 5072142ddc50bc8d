#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <string>

namespace berth::test {

/// A connection to a server on this machine that sends what it is told, byte for byte.
class WebClient {
 public:
  explicit WebClient(int port, int receive_buffer = 0) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~WebClient() { close(); }
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  void close() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }
  /// As much of it as the other side takes.
  void send(const std::string& text) {
    std::size_t at = 0;
    while (at < text.size()) {
      const ssize_t gone = ::send(socket_, text.data() + at, text.size() - at, MSG_NOSIGNAL);
      if (gone <= 0) return;
      at += static_cast<std::size_t>(gone);
    }
  }
  /// Nothing more comes.
  void finish() { shutdown(socket_, SHUT_WR); }
  void get(const std::string& path, const std::string& more = "") {
    send("GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\n" + more + "\r\n");
  }

  /// Reads on until `enough` stands in what came, or the other side is done; everything that came so far.
  const std::string& read_until(const std::string& enough) {
    while (came_.find(enough) == std::string::npos && read_some()) {
    }
    return came_;
  }
  const std::string& read_all() {
    while (read_some()) {
    }
    return came_;
  }
  /// Forgets what came up to and including `text`, waiting for it; what came before it.
  std::string take_through(const std::string& text) {
    read_until(text);
    const std::size_t at = came_.find(text);
    EXPECT_NE(at, std::string::npos) << text;
    if (at == std::string::npos) return {};
    std::string taken = came_.substr(0, at);
    came_.erase(0, at + text.size());
    return taken;
  }
  std::string take(std::size_t bytes) {
    while (came_.size() < bytes && read_some()) {
    }
    std::string taken = came_.substr(0, bytes);
    came_.erase(0, bytes);
    return taken;
  }

 private:
  /// A server that says nothing for a minute has hung.
  bool read_some() {
    pollfd one = {socket_, POLLIN, 0};
    if (poll(&one, 1, 60'000) <= 0) return false;
    std::array<char, 65536> buffer;
    const ssize_t came = recv(socket_, buffer.data(), buffer.size(), 0);
    if (came <= 0) return false;
    came_.append(buffer.data(), static_cast<std::size_t>(came));
    return true;
  }

  int socket_;
  std::string came_;
};

/// The whole answer to one request, which need not be whole itself.
inline std::string answer_to(int port, const std::string& request) {
  WebClient client(port);
  client.send(request);
  client.finish();
  return client.read_all();
}
inline std::string answer_to_get(int port, const std::string& path, const std::string& more = "") {
  WebClient client(port);
  client.get(path, more);
  return client.read_all();
}

}  // namespace berth::test
