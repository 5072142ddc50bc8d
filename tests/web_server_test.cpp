// The live view's server as a network meets it: what it hands out, what it refuses, and that nobody who is slow or rude
// holds anything up.
#include "web_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "berth/error.hpp"
#include "support/complaint.hpp"
#include "support/pictures.hpp"
#include "support/web_client.hpp"
#include "web_assets.hpp"

namespace berth::cli {
namespace {

using test::answer_to;
using test::answer_to_get;
using test::WebClient;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr const char* kToken = "0123456789abcdef";

class WebServerTest : public testing::Test {
 protected:
  void serve(const std::string& token = "") {
    WebContent content;
    content.feed = &feed;
    content.about_version = [] { return u64{1}; };
    content.about = [] { return Json({{"run", "r"}}); };
    content.times = [] { return Json::array(); };
    content.token = token;
    content.end_run = [this] { ++ended; };
    server = std::make_unique<WebServer>(WebAddress{"127.0.0.1", 0}, std::move(content));
    port = server->port();
  }
  void SetUp() override { serve(); }

  std::string post(const std::string& body, const std::string& token) {
    return answer_to(port, "POST /control HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer " + token +
                               "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  }
  void publish(u64 frame, std::size_t samples = 1) {
    WebStatus status;
    status.frames = frame;
    std::vector<WebSample> some(samples);
    for (WebSample& sample : some) sample.time_s = static_cast<double>(frame);
    feed.publish(status, some, {{"tag36h11 7", "marker", 0.1}});
  }
  void show(u64 number, std::size_t bytes) {
    const auto picture = std::make_shared<WebPicture>();
    picture->number = number;
    picture->jpeg.assign(bytes, 'x');
    picture->about = "{\"number\":" + std::to_string(number) + "}";
    feed.show(picture);
  }
  /// Reads the head and the bytes of one picture that is not only sent again; its number.
  static int next_picture(WebClient& client) {
    while (true) {
      const std::string head = client.take_through("\r\n\r\n");
      const std::size_t size = head.find("Content-Length: "), number = head.find("\"number\":");
      EXPECT_NE(number, std::string::npos) << head;
      if (number == std::string::npos) return -1;
      client.take(std::stoul(head.substr(size + 16)) + 2);
      if (head.find("X-Berth-Repeated: 1") == std::string::npos) return std::stoi(head.substr(number + 9));
    }
  }

  WebFeed feed;
  std::atomic<int> ended = 0;
  std::unique_ptr<WebServer> server;
  int port = 0;
};

TEST(WebAddress, IsReadInEveryForm) {
  const auto is = [](const char* text, const char* host, int port) {
    const WebAddress address = parse_web_address(text);
    EXPECT_EQ(address.host, host) << text;
    EXPECT_EQ(address.port, port) << text;
  };
  is("", "127.0.0.1", 8040);
  is("8041", "127.0.0.1", 8041);
  is(":8041", "127.0.0.1", 8041);
  is("0.0.0.0", "0.0.0.0", 8040);
  is("robot.local:80", "robot.local", 80);
  is("[::1]:8041", "::1", 8041);
  is("[::1]", "::1", 8040);
  is("127.0.0.1:0", "127.0.0.1", 0);
  for (const char* wrong :
       {"127.0.0.1:", "127.0.0.1:99999", "127.0.0.1:80a", "[::1", "[::1]x", "a b:80", "1234567", "http://a/:1"}) {
    EXPECT_THAT(test::complaint([&] { parse_web_address(wrong); }),
                testing::AllOf(StartsWith(std::string("--view ") + wrong), HasSubstr("e.g. 127.0.0.1:8040")));
  }
}

TEST_F(WebServerTest, OutlivesRequestsThatAreCutOffOrDamaged) {
  const std::string host = " HTTP/1.1\r\nHost: localhost\r\n";
  const std::vector<std::string> whole = {
      "GET /state.json" + host + "Accept: */*\r\n\r\n",
      "GET /" + host + "Range: bytes=0-9,20-\r\nAccept-Encoding: gzip, br\r\nConnection: close\r\n\r\n",
      "GET /times.json?from=3&to=%34" + host + "If-None-Match: \"x\"\r\n\r\n",
      "POST /control" + host + "Authorization: Bearer " + kToken + "\r\nContent-Length: 4\r\n\r\nstop",
      "POST /control" + host + "Transfer-Encoding: chunked\r\n\r\n4\r\nstop\r\n0\r\n\r\n",
      "POST /control" + host +
          "Content-Type: multipart/form-data; boundary=b\r\nContent-Length: 62\r\n\r\n--b\r\nContent-Disposition: "
          "form-data; name=\"a\"\r\n\r\nstop\r\n--b--\r\n"};
  pictures::Random random(11);
  for (int i = 0; i < 240; ++i) {
    std::string request = whole[static_cast<std::size_t>(i) % whole.size()];
    const auto some = [&](std::size_t below) {
      return static_cast<std::size_t>(random.below(static_cast<int>(below)));
    };
    if (i % 3 == 0) request.resize(some(request.size()));
    for (int k = 0; k < i % 4 && !request.empty(); ++k) request[some(request.size())] = static_cast<char>(some(256));
    if (i % 7 == 0) request.insert(some(request.size() + 1), some(3000), static_cast<char>('!' + some(90)));
    const std::string answer = answer_to(port, request);
    EXPECT_THAT(answer, testing::AnyOf(testing::IsEmpty(), StartsWith("HTTP/1.1 "))) << i;
    EXPECT_THAT(answer, Not(StartsWith("HTTP/1.1 5"))) << i;
  }
  EXPECT_THAT(answer_to_get(port, "/state.json"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(ended, 0);
}

TEST_F(WebServerTest, HandsOutThePageAndWhatItNeeds) {
  const std::string page = answer_to_get(port, "/");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(page, HasSubstr("Content-Security-Policy: default-src 'none'"));
  EXPECT_THAT(page, HasSubstr("X-Content-Type-Options: nosniff"));
  int served = 0;
  for (const WebAsset& asset : web_assets()) {
    EXPECT_FALSE(asset.bytes.empty()) << asset.name;
    if (asset.name == "view.html") continue;
    const std::string answer = answer_to_get(port, "/" + asset.name);
    EXPECT_THAT(answer, StartsWith(asset.is_served ? "HTTP/1.1 200" : "HTTP/1.1 404")) << asset.name;
    if (!asset.is_served) continue;
    ++served;
    EXPECT_THAT(page, HasSubstr("\"" + asset.name + "\"")) << "nothing on the page asks for it";
    const std::size_t body = answer.find("\r\n\r\n") + 4;
    EXPECT_TRUE(answer.compare(body, std::string::npos, asset.bytes) == 0) << asset.name;
  }
  EXPECT_GT(served, 5);
}

TEST_F(WebServerTest, HasNoFiles) {
  for (const char* path : {"/../../etc/passwd", "/..%2f..%2fetc%2fpasswd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd",
                           "/view.css/../../../etc/passwd", "/view.css%00", "/viewXcss", "/etc/passwd", "/three.js/"}) {
    const std::string answer = answer_to_get(port, path);
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 404")) << path;
    EXPECT_THAT(answer, Not(HasSubstr("root:"))) << path;
  }
}

TEST_F(WebServerTest, OutlivesWhatMakesNoSense) {
  for (const std::string& request :
       {std::string("\r\n\r\n"), std::string("GET\r\n\r\n"), std::string("GET / HTTP/9.9\r\n\r\n"),
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\r\n\r\n", 13), std::string("GET / HTTP/1.1\r\nHost\r\n\r\n"),
        std::string("POST /control HTTP/1.1\r\nHost: localhost\r\nContent-Length: -5\r\n\r\n"),
        std::string("POST /control HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n"),
        std::string("DELETE / HTTP/1.1\r\nHost: localhost\r\n\r\n"), std::string(3000, '\0') + "\r\n\r\n"}) {
    EXPECT_THAT(answer_to(port, request), Not(StartsWith("HTTP/1.1 2"))) << request;
  }
  EXPECT_THAT(answer_to_get(port, "/"), StartsWith("HTTP/1.1 200"));
}

TEST_F(WebServerTest, BoundsTheSizeOfARequest) {
  EXPECT_THAT(answer_to_get(port, "/" + std::string(9000, 'a')), Not(StartsWith("HTTP/1.1 2")));
  // Many headers, each of which is short.
  std::string headers;
  for (int i = 0; i < 3000; ++i) headers += "X-" + std::to_string(i) + ": y\r\n";
  EXPECT_THAT(answer_to_get(port, "/", headers), Not(StartsWith("HTTP/1.1 2")));
  EXPECT_THAT(post(std::string(WebServer::kMostBody + 1, 'a'), kToken), StartsWith("HTTP/1.1 413"));
  // More than is announced, and more than the server ever reads.
  EXPECT_THAT(answer_to(port, "POST /control HTTP/1.1\r\nHost: localhost\r\nContent-Length: 999999999\r\n\r\n" +
                                  std::string(200'000, 'a')),
              Not(StartsWith("HTTP/1.1 2")));
  EXPECT_THAT(answer_to_get(port, "/", "X-Fits: " + std::string(2000, 'a') + "\r\n"), StartsWith("HTTP/1.1 200"));
}

TEST_F(WebServerTest, IsAskedForByItsOwnNameOnly) {
  const auto ask = [&](const std::string& host) { return answer_to(port, "GET / HTTP/1.1\r\n" + host + "\r\n"); };
  EXPECT_THAT(ask("Host: localhost:8040\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("Host: 10.1.2.3:8040\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("Host: [::1]:8040\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("Host: stranger.example\r\n"), StartsWith("HTTP/1.1 421"));
  EXPECT_THAT(ask("Host: 127.0.0.1.stranger.example\r\n"), StartsWith("HTTP/1.1 421"));
  EXPECT_THAT(ask(""), StartsWith("HTTP/1.1 421"));
}

TEST_F(WebServerTest, ReadsOnlyWithoutAToken) {
  EXPECT_THAT(post("{\"do\":\"end\"}", ""), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(post("{\"do\":\"end\"}", kToken), StartsWith("HTTP/1.1 403"));
  EXPECT_EQ(ended, 0);
}

TEST_F(WebServerTest, EndsTheRunForWhoeverHasTheToken) {
  serve(kToken);
  EXPECT_THAT(post("{\"do\":\"end\"}", ""), StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(post("{\"do\":\"end\"}", std::string(kToken) + "x"), StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(post("{\"do\":\"end\"}", "0123456789abcdeX"), StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(answer_to_get(port, "/control", std::string("Authorization: Bearer ") + kToken + "\r\n"),
              StartsWith("HTTP/1.1 404"));
  for (const char* body : {"", "{}", "[]", "{\"do\":1}", "{\"do\":\"fly\"}", "{\"do\":"}) {
    EXPECT_THAT(post(body, kToken), StartsWith("HTTP/1.1 400")) << body;
  }
  EXPECT_EQ(ended, 0);
  EXPECT_THAT(post("{\"do\":\"end\"}", kToken), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(ended, 1);
}

TEST_F(WebServerTest, TellsANewViewerWhatWentBefore) {
  for (u64 frame = 1; frame <= 700; ++frame) publish(frame);
  WebClient client(port);
  client.get("/events");
  client.take_through("event: about\ndata: ");
  EXPECT_EQ(Json::parse(client.take_through("\n"))["run"], "r");
  std::size_t samples = 0;
  while (samples < 700) {
    client.take_through("event: state\ndata: ");
    const Json state = Json::parse(client.take_through("\n"));
    if (samples == 0) {
      EXPECT_EQ(state["objects"][0]["name"], "tag36h11 7");
    }
    samples += state.value("samples", Json::array()).size();
  }
  EXPECT_EQ(samples, 700u);
  publish(701);
  client.take_through("event: state\ndata: ");
  feed.end();
  client.read_until("\"ended\":true");
  // Nothing of this stops the server from going away.
  server.reset();
  EXPECT_THAT(client.read_all(), HasSubstr("\"ended\":true"));
}

TEST_F(WebServerTest, KeepsWhatItHasRoomFor) {
  for (u64 frame = 1; frame <= WebFeed::kKept + 100; ++frame) publish(frame);
  u64 cursor = 0;
  const std::vector<WebSample> oldest = feed.samples(cursor, 1);
  ASSERT_EQ(oldest.size(), 1u);
  EXPECT_EQ(oldest[0].time_s, 101);
  EXPECT_EQ(cursor, 101u);
  EXPECT_EQ(feed.newest(), WebFeed::kKept + 100);
  EXPECT_EQ(feed.lost(), 0u);
}

TEST_F(WebServerTest, RefusesViewersPastTheMost) {
  for (const char* path : {"/events", "/video.mjpg"}) {
    std::vector<std::unique_ptr<WebClient>> clients;
    for (int i = 0; i < WebServer::kMostStreams; ++i) {
      clients.push_back(std::make_unique<WebClient>(port));
      clients.back()->get(path);
      EXPECT_THAT(clients.back()->read_until("\r\n\r\n"), StartsWith("HTTP/1.1 200"));
    }
    const std::string refused = answer_to_get(port, path);
    EXPECT_THAT(refused, StartsWith("HTTP/1.1 503"));
    EXPECT_THAT(refused, HasSubstr("Retry-After"));
    EXPECT_THAT(answer_to_get(port, "/state.json"), StartsWith("HTTP/1.1 200"));
    clients.front()->close();
    // Its place is free as soon as the server finds it gone: with the next pictures.
    std::string again;
    for (u64 i = 1; i < 100'000 && again.find("200") == std::string::npos; ++i) {
      show(i + 1'000'000 * (path[1] == 'v'), 10);
      WebClient next(port);
      next.get(path);
      again = next.read_until("\r\n");
    }
    EXPECT_THAT(again, StartsWith("HTTP/1.1 200"));
  }
}

TEST_F(WebServerTest, TurnsConnectionsPastTheMostAway) {
  std::vector<std::unique_ptr<WebClient>> silent;
  for (int i = 0; i < WebServer::kMostConnections; ++i) {
    silent.push_back(std::make_unique<WebClient>(port));
    silent.back()->send("GET / HT");
  }
  // All of them are taken on in order, so this one finds none left.
  EXPECT_THAT(answer_to_get(port, "/"), StartsWith("HTTP/1.1 503"));
  EXPECT_GE(server->refused(), 1u);
  silent.clear();
  std::string again;
  while (again.find("200") == std::string::npos) again = answer_to_get(port, "/state.json").substr(0, 15);
}

TEST_F(WebServerTest, WaitsForNoViewerThatIsSlow) {
  constexpr u64 kPictures = 400;
  constexpr std::size_t kBytes = 100'000;
  WebClient slow(port, 4096), fast(port);
  slow.get("/video.mjpg");
  slow.read_until("\r\n\r\n");
  fast.get("/video.mjpg");
  fast.take_through("\r\n\r\n");
  WebClient deaf(port, 4096);
  deaf.get("/events");
  // 40 MB: far more than sockets hold. A feed that waited for its viewers would not come through here.
  int newest = 0;
  for (u64 i = 1; i <= kPictures; ++i) {
    show(i, kBytes);
    publish(i, 40);
    const int seen = next_picture(fast);
    EXPECT_EQ(seen, static_cast<int>(i));
    newest = seen;
  }
  EXPECT_EQ(newest, static_cast<int>(kPictures));
  EXPECT_EQ(feed.newest(), kPictures * 40);
  EXPECT_EQ(feed.lost(), 0u);
  // The slow one has missed most, and comes to the newest all the same.
  slow.take_through("\r\n\r\n");
  int pictures = 0;
  for (int at = 0; at < static_cast<int>(kPictures); ++pictures) at = next_picture(slow);
  EXPECT_LT(pictures, 50);
}

TEST_F(WebServerTest, SaysWhenItsAddressIsTaken) {
  WebContent content;
  WebFeed other;
  content.feed = &other;
  EXPECT_THAT(test::complaint([&] {
                WebServer(WebAddress{"127.0.0.1", port}, content);
              }),
              testing::AllOf(StartsWith("--view 127.0.0.1:" + std::to_string(port)), HasSubstr("another port")));
}

}  // namespace
}  // namespace berth::cli
