// What `berth run` tells a service manager.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "recording/recover.hpp"
#include "support/command_run.hpp"

namespace berth {
namespace {

using test::run_berth;
using testing::HasSubstr;

const std::string kFrames = "sim:" BERTH_SOURCE_DIR "/scenarios/track.toml";

/// A service manager: a socket at that address, and what was sent to it.
class Manager {
 public:
  Manager(const std::string& name, bool is_abstract) : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path + (is_abstract ? 1 : 0), name.data(), name.size());
    const std::size_t length = offsetof(sockaddr_un, sun_path) + name.size() + 1;
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), static_cast<socklen_t>(length)), 0) << name;
    setenv("NOTIFY_SOCKET", ((is_abstract ? "@" : "") + name).c_str(), 1);
  }
  ~Manager() {
    unsetenv("NOTIFY_SOCKET");
    close(socket_);
  }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  std::vector<std::string> messages() {
    std::vector<std::string> all;
    char text[256];
    for (ssize_t size; (size = recv(socket_, text, sizeof text, 0)) > 0;) {
      all.emplace_back(text, static_cast<std::size_t>(size));
    }
    return all;
  }

 private:
  int socket_;
};

void expect_told(const std::vector<std::string>& messages) {
  ASSERT_GE(messages.size(), 2u);
  EXPECT_EQ(messages.front(), "READY=1\nWATCHDOG=1");
  for (std::size_t i = 1; i + 1 < messages.size(); ++i) EXPECT_EQ(messages[i], "WATCHDOG=1");
  EXPECT_EQ(messages.back(), "STOPPING=1");
}

TEST(ServiceNotify, FramesFeedTheWatchdogByASocketsPathOrItsAbstractName) {
  const test::ScratchFolder folder;
  {
    Manager manager(folder / "notify", false);
    EXPECT_EQ(run_berth({"run", "--source", kFrames, "--max-frames", "2"}).exit_code, 0);
    expect_told(manager.messages());
  }
  Manager manager("berth-test-" + std::to_string(getpid()), true);
  EXPECT_EQ(run_berth({"run", "--source", kFrames, "--max-frames", "2"}).exit_code, 0);
  expect_told(manager.messages());
}

// What `systemctl stop` and `docker stop` send: the run ends with its summary, and the recording is whole.
TEST(ServiceNotify, ASignalToEndEndsTheRunAsCtrlCDoes) {
  const test::ScratchFolder folder;
  Manager manager(folder / "notify", false);
  std::thread systemd([&] {
    while (manager.messages().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(getpid(), SIGTERM);
  });
  const std::string recording = folder / "run.mcap";
  const test::CommandRun run =
      run_berth({"run", "--source", kFrames, "--fps", "30", "--minutes", "5", "--record", recording});
  systemd.join();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("interrupted\n"));
  EXPECT_EQ(manager.messages().back(), "STOPPING=1");
  EXPECT_TRUE(mcap::examine(recording).whole);
}

TEST(ServiceNotify, WithoutFramesNothingIsSaid) {
  const test::ScratchFolder folder;
  Manager manager(folder / "notify", false);
  EXPECT_EQ(run_berth({"run", "--source", "file:" + folder.write("bad.png", std::string("no image"))}).exit_code, 2);
  for (const std::string& message : manager.messages()) EXPECT_EQ(message, "STOPPING=1");
}

TEST(ServiceNotify, AManagerThatIsGoneHoldsNothingUpAndABadNameIsRefused) {
  setenv("NOTIFY_SOCKET", "/nowhere/notify", 1);
  EXPECT_EQ(run_berth({"run", "--source", kFrames, "--max-frames", "1"}).exit_code, 0);
  setenv("NOTIFY_SOCKET", "notify", 1);
  const test::CommandRun run = run_berth({"run", "--source", kFrames, "--max-frames", "1"});
  unsetenv("NOTIFY_SOCKET");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("NOTIFY_SOCKET is 'notify'; it is a path"));
}

}  // namespace
}  // namespace berth
