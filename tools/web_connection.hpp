#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <string>

namespace berth::cli {

/// A connection to a viewer, a socket that it closes in the end: the whole request has to come within `kRequest` and
/// `most` bytes, and a viewer that takes nothing for `kStalled` is given up.
class WebConnection {
 public:
  WebConnection(int socket, std::size_t most);
  ~WebConnection();
  WebConnection(const WebConnection&) = delete;
  WebConnection& operator=(const WebConnection&) = delete;

  /// Says that there are too many, without waiting for what is asked.
  void refuse();

  bool is_readable() const;
  /// Waits until it is.
  bool is_writable() const;
  /// As recv and send; below 0 past a bound.
  ssize_t read(char* to, std::size_t size);
  ssize_t write(const char* from, std::size_t size);
  /// Numeric address and port of the viewer's end, or of this one.
  void name_end(bool is_remote, std::string& ip, int& port) const;
  int socket() const { return socket_; }

 private:
  static constexpr std::chrono::seconds kRequest{5}, kStalled{5};

  int socket_;
  std::size_t left_;
  bool is_refused_ = false;
  const std::chrono::steady_clock::time_point due_ = std::chrono::steady_clock::now() + kRequest;
  /// The HTTP library reads headers byte by byte.
  std::array<char, 2048> buffer_ = {};
  std::size_t at_ = 0, filled_ = 0;
};

}  // namespace berth::cli
