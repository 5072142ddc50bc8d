#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "web_address.hpp"
#include "web_feed.hpp"
#include "web_messages.hpp"
#include "web_recording.hpp"

namespace berth::cli {

/// What a server hands out, and what may be asked of it. Everything is called from its threads.
struct WebContent {
  WebFeed* feed = nullptr;
  /// Grows when `about` changes.
  std::function<u64()> about_version;
  std::function<Json()> about;
  std::function<Json()> times;
  /// Whoever shows it may end the run; empty: nobody.
  std::string token;
  std::function<void()> end_run;
  /// Null for a run.
  WebRecording* recording = nullptr;
};

/// The page and its data over HTTP, one thread a connection and one request each. Threads are few and ordinary,
/// whatever the stream's are, and give way to it where the processor is short. No file is ever read: what is handed out
/// was built in.
class WebServer {
 public:
  /// Streams of events and of video at once, each; and connections in all. More are refused, not queued.
  static constexpr int kMostStreams = 8, kMostConnections = 32;
  /// Bytes of a request's line and headers, and of its body.
  static constexpr std::size_t kMostHead = 8192, kMostBody = 1024;

  /// Serves at once. Throws Error where the address cannot be had.
  WebServer(const WebAddress& address, WebContent content);
  /// Closes the feed; returns when every connection has ended.
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;
  /// "http://127.0.0.1:8040/"
  std::string url() const;
  int event_streams() const;
  int video_streams() const;
  /// Connections and streams refused so far.
  u64 refused() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth::cli
