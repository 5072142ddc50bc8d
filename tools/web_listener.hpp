#pragma once

#include <httplib.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "berth/types.hpp"
#include "pipeline/thread_setup.hpp"
#include "web_connection.hpp"

// How the HTTP library is made to keep bounds of threads, sizes and times. For web_server.cpp alone.
namespace berth::cli {

/// Set on the thread that accepts while it turns a connection away.
inline thread_local bool is_refusing = false;

/// `gives_way`: to a stream, which goes first.
inline void become_a_servant(bool gives_way) {
  name_thread("berth-view");
  make_ordinary();
  // Where that is not allowed, the thread is like any other.
  if (gives_way) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
}

/// Threads made when they are first needed. What comes while all of them are busy is turned away at once.
class Workers final : public httplib::TaskQueue {
 public:
  Workers(std::atomic<u64>& refused, int most, bool give_way) : refused_(refused), most_(most), give_way_(give_way) {}

  /// What enqueue returns: nothing, or from 0.13 on whether the job was taken.
  using Taken = decltype(std::declval<httplib::TaskQueue&>().enqueue(std::declval<std::function<void()>>()));

  Taken enqueue(std::function<void()> job) override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (under_way_ < most_) {
        ++under_way_;
        jobs_.push_back(std::move(job));
        if (jobs_.size() > static_cast<std::size_t>(idle_)) threads_.emplace_back([this] { work(); });
        more_.notify_one();
        return Taken(true);
      }
    }
    ++refused_;
    is_refusing = true;
    job();
    is_refusing = false;
    return Taken(true);  // it is done with: the library must not close the connection once more
  }

  void shutdown() override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_over_ = true;
    }
    more_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  void work() {
    become_a_servant(give_way_);
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      ++idle_;
      more_.wait(lock, [this] { return is_over_ || !jobs_.empty(); });
      --idle_;
      if (jobs_.empty()) return;
      const std::function<void()> job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      job();
      lock.lock();
      --under_way_;
    }
  }

  std::atomic<u64>& refused_;
  const int most_;
  const bool give_way_;
  std::mutex mutex_;
  std::condition_variable more_;
  std::deque<std::function<void()>> jobs_;
  std::vector<std::thread> threads_;
  int idle_ = 0, under_way_ = 0;
  bool is_over_ = false;
};

/// A connection as the HTTP library wants it.
class Connection final : public httplib::Stream {
 public:
  explicit Connection(WebConnection& connection) : connection_(connection) {}
  bool is_readable() const override { return connection_.is_readable(); }
  bool is_writable() const override { return connection_.is_writable(); }
  ssize_t read(char* to, std::size_t size) override { return connection_.read(to, size); }
  ssize_t write(const char* from, std::size_t size) override { return connection_.write(from, size); }
  void get_remote_ip_and_port(std::string& ip, int& port) const override { connection_.name_end(true, ip, port); }
  void get_local_ip_and_port(std::string& ip, int& port) const override { connection_.name_end(false, ip, port); }
  socket_t socket() const override { return connection_.socket(); }

 private:
  WebConnection& connection_;
};

/// One request a connection, within bounds of size and time; the library has none for the headers as a whole.
class Listener final : public httplib::Server {
 public:
  /// `most`: bytes of a request.
  explicit Listener(std::size_t most) : most_(most) {}
  /// The library's own queue of five loses connections that come at once.
  void widen_queue(int connections) { ::listen(svr_sock_, connections); }

 private:
  bool process_and_close_socket(socket_t socket) override {
    WebConnection connection(socket, most_);
    if (is_refusing) {
      connection.refuse();
      return false;
    }
    Connection stream(connection);
    bool closed = false;
    return answer(*this, connection, stream, closed, 0);
  }

  /// As the library has it up to 0.17, and with the ends' addresses since. Templates, so that the one it has is
  /// compiled.
  template <class Self>
  static auto answer(Self& self, WebConnection&, Connection& stream, bool& closed, int)
      -> decltype(self.process_request(stream, true, closed, nullptr)) {
    return self.process_request(stream, true, closed, nullptr);
  }
  template <class Self>
  static bool answer(Self& self, WebConnection& connection, Connection& stream, bool& closed, long) {
    std::string remote, local;
    int remote_port = 0, local_port = 0;
    connection.name_end(true, remote, remote_port);
    connection.name_end(false, local, local_port);
    return self.process_request(stream, remote, remote_port, local, local_port, true, closed, nullptr);
  }

  const std::size_t most_;
};

}  // namespace berth::cli
