// With web_listener.hpp, all that knows the HTTP library.
#include "web_server.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "berth/error.hpp"
#include "web_assets.hpp"
#include "web_listener.hpp"

namespace berth::cli {
namespace {

using std::chrono::milliseconds;

/// Between two events to a viewer, while frames come and while none do.
constexpr milliseconds kEventEvery(80), kBeatEvery(250);
/// A picture is sent again after this time without another: a viewer that has gone shows.
constexpr milliseconds kRepeatEvery(2000);
constexpr std::size_t kSamplesAnEvent = 512;
constexpr u64 kHistory = 6000;
constexpr double kTimesEveryS = 1;
/// What whoever tries tokens waits for each.
constexpr milliseconds kWrongTokenWait(300);
constexpr const char* kBoundary = "berthpicture";

/// In a time that does not tell how much of it is right.
bool is_same(const std::string& a, const std::string& b) {
  unsigned different = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i) {
    different |=
        static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i % std::max<std::size_t>(1, b.size())]);
  }
  return different == 0;
}

void answer(httplib::Response& response, int status, const std::string& text) {
  response.status = status;
  response.set_content(text + "\n", "text/plain; charset=utf-8");
}

std::string event(const char* name, const Json& data) {
  return std::string("event: ") + name + "\ndata: " + to_line(data) + "\n\n";
}

}  // namespace

struct WebServer::Impl {
  Impl(const WebAddress& address_asked, WebContent content_given)
      : address(address_asked), content(std::move(content_given)) {}

  /// Takes one of the streams there may be at once; null when there is none left. Given back by the last copy.
  std::shared_ptr<void> take(std::atomic<int>& streams) {
    if (++streams > kMostStreams) {
      --streams;
      ++refused;
      return nullptr;
    }
    return {&streams, [](std::atomic<int>* taken) { --*taken; }};
  }

  /// There is a stream beside it.
  bool gives_way() const { return content.recording == nullptr; }

  void set_up() {
    server.new_task_queue = [this] { return new Workers(refused, kMostConnections, gives_way()); };
    server.set_payload_max_length(kMostBody);
    server.set_keep_alive_max_count(1);
    // Without the library's SO_REUSEPORT, by which two runs could share a port unawares.
    server.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server.set_default_headers(
        {{"Cache-Control", "no-store"},
         {"Content-Security-Policy",
          "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
          "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
         {"Referrer-Policy", "no-referrer"},
         {"X-Content-Type-Options", "nosniff"}});
    server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
      if (is_own_name(request.get_header_value("Host"))) return httplib::Server::HandlerResponse::Unhandled;
      answer(response, 421, "this page is served by its address or this machine's name only; open it by one of those");
      return httplib::Server::HandlerResponse::Handled;
    });
    server.set_exception_handler([](const httplib::Request&, httplib::Response& response, const std::exception_ptr&) {
      answer(response, 500, "this request failed");
    });
    server.set_error_handler([](const httplib::Request&, httplib::Response& response) {
      if (response.body.empty()) answer(response, response.status, httplib_status(response.status));
    });
    for (const WebAsset& asset : web_assets()) {
      if (!asset.is_served) continue;
      const std::string path = asset.name == "view.html" ? "/" : "/" + asset.name;
      std::string pattern;
      for (const char c : path) pattern += c == '.' ? "\\." : std::string(1, c);
      server.Get(pattern, [&asset](const httplib::Request&, httplib::Response& response) {
        response.set_content(asset.bytes.data(), asset.bytes.size(), asset.type);
      });
    }
    server.Get("/state\\.json", [this](const httplib::Request&, httplib::Response& response) {
      Json json = {{"about", content.about()}, {"state", state()}, {"times", content.times()}};
      response.set_content(to_line(json) + "\n", "application/json");
    });
    server.Get("/events", [this](const httplib::Request&, httplib::Response& response) { send_events(response); });
    server.Get("/video\\.mjpg", [this](const httplib::Request&, httplib::Response& response) { send_video(response); });
    if (content.recording != nullptr) serve_recording();
    server.Post("/control",
                [this](const httplib::Request& request, httplib::Response& response) { control(request, response); });
  }

  /// `get` answers for a frame's number, as the request has it in `field`; what is damaged is told.
  void get_numbered(const char* pattern, const char* field, std::size_t end,
                    const std::function<void(std::size_t, httplib::Response&)>& get) {
    server.Get(pattern, [field, end, get](const httplib::Request& request, httplib::Response& response) {
      const std::string text = request.get_param_value(field);
      constexpr std::size_t kMostDigits = 12;
      const bool is_number =
          !text.empty() && text.size() <= kMostDigits && text.find_first_not_of("0123456789") == std::string::npos;
      const std::size_t number = is_number ? std::stoull(text) : end;
      if (number >= end) return answer(response, 400, fmt::format("give {}= and a number below {}", field, end));
      try {
        get(number, response);
      } catch (const Error& error) {
        answer(response, 422, error.what());
      }
    });
  }

  void serve_recording() {
    WebRecording& recording = *content.recording;
    const std::size_t frames = recording.frames();
    get_numbered("/track\\.json", "from", frames, [&recording](std::size_t from, httplib::Response& response) {
      response.set_content(to_line(recording.track(from)) + "\n", "application/json");
    });
    get_numbered("/frame\\.json", "frame", frames, [&recording](std::size_t number, httplib::Response& response) {
      response.set_content(to_line(recording.frame(number)) + "\n", "application/json");
    });
    get_numbered("/picture\\.jpg", "frame", frames, [&recording](std::size_t number, httplib::Response& response) {
      const std::shared_ptr<const WebPicture> picture = recording.picture(number);
      if (!picture) return answer(response, 404, "this frame was recorded without its picture");
      response.set_header("X-Berth-Picture", picture->about);
      response.set_content(picture->jpeg, "image/jpeg");
    });
  }

  static std::string httplib_status(int status) {
    switch (status) {
      case 400:
        return "the request makes no sense";
      case 404:
        return "there is nothing of that name here";
      case 413:
        return "the request is too large";
      case 414:
        return "the address is too long";
      default:
        return fmt::format("status {}", status);
    }
  }

  Json state() const {
    WebFeed& feed = *content.feed;
    const bool ended = feed.has_ended();  // before the status: none comes after it
    Json json = to_json(feed.status(), feed.now_s(), ended);
    json["viewers"] = {{"events", event_streams.load()}, {"video", video_streams.load()}, {"refused", refused.load()}};
    return json;
  }

  /// What one viewer of the events has been told.
  struct Told {
    u64 about = 0, cursor = 0, frames = 0;
    std::size_t objects = 0;
    double sent_s = -1e9, times_s = -1e9;
    bool ended = false;
  };

  void send_events(httplib::Response& response) {
    const std::shared_ptr<void> slot = take(event_streams);
    if (!slot) return refuse_stream(response);
    auto told = std::make_shared<Told>();
    told->cursor = content.feed->newest() > kHistory ? content.feed->newest() - kHistory : 0;
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, slot, told](std::size_t, httplib::DataSink& sink) { return send_event(*told, sink); });
  }

  /// At most one event. False ends the connection.
  bool send_event(Told& told, httplib::DataSink& sink) {
    WebFeed& feed = *content.feed;
    if (feed.is_closed()) {
      sink.done();
      return true;
    }
    std::string text;
    if (const u64 version = content.about_version(); version != told.about) {
      told.about = version;
      text += event("about", content.about());
    }
    Json json = state();
    const std::vector<WebSample> samples = feed.samples(told.cursor, kSamplesAnEvent);
    const std::vector<WebObject> objects = feed.objects(told.objects);
    const u64 frames = json["frames"];
    const bool ended = json["ended"];
    const double now_s = feed.now_s();
    const bool is_news = frames != told.frames || ended != told.ended || !samples.empty() || !objects.empty();
    if (is_news || now_s - told.sent_s > std::chrono::duration<double>(kBeatEvery).count()) {
      if (!objects.empty()) {
        json["objects"] = to_json(objects);
        json["objects_from"] = told.objects;
      }
      for (const WebSample& sample : samples) json["samples"].push_back(to_json(sample));
      if (now_s - told.times_s > kTimesEveryS || ended) {
        json["times"] = content.times();
        told.times_s = now_s;
      }
      text += event("state", json);
      told.objects += objects.size();
      told.frames = frames;
      told.ended = ended;
      told.sent_s = now_s;
    }
    if (!text.empty() && !sink.write(text.data(), text.size())) return false;
    if (samples.size() < kSamplesAnEvent) feed.sleep(kEventEvery);
    return true;
  }

  void send_video(httplib::Response& response) {
    const std::shared_ptr<void> slot = take(video_streams);
    if (!slot) return refuse_stream(response);
    const auto sent = std::make_shared<std::shared_ptr<const WebPicture>>();
    response.set_content_provider(
        std::string("multipart/x-mixed-replace; boundary=") + kBoundary,
        [this, slot, sent](std::size_t, httplib::DataSink& sink) { return send_picture(*sent, sink); });
  }

  /// The newest picture there is: a slow viewer misses those between, and nobody waits for it.
  bool send_picture(std::shared_ptr<const WebPicture>& sent, httplib::DataSink& sink) {
    const std::shared_ptr<const WebPicture> next = content.feed->picture(sent ? sent->number : 0, kRepeatEvery);
    if (content.feed->is_closed()) {
      sink.done();
      return true;
    }
    const bool is_repeated = !next && sent;
    if (next) sent = next;
    if (!sent) return sink.write("\r\n", 2);  // before the first boundary anything may stand
    const std::string head = fmt::format(
        "--{}\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\nX-Berth-Repeated: {}\r\nX-Berth-Picture: {}\r\n\r\n",
        kBoundary, sent->jpeg.size(), is_repeated ? 1 : 0, sent->about);
    return sink.write(head.data(), head.size()) && sink.write(sent->jpeg.data(), sent->jpeg.size()) &&
           sink.write("\r\n", 2);
  }

  static void refuse_stream(httplib::Response& response) {
    response.set_header("Retry-After", "5");
    answer(response, 503, fmt::format("{} viewers are watching, which is the most; close one", kMostStreams));
  }

  void control(const httplib::Request& request, httplib::Response& response) {
    if (content.token.empty()) {
      return answer(response, 403, "this view is read-only; start berth with --view-token to change that");
    }
    if (!is_same(request.get_header_value("Authorization"), "Bearer " + content.token)) {
      content.feed->sleep(kWrongTokenWait);
      response.set_header("WWW-Authenticate", "Bearer");
      return answer(response, 401, "the token is missing or wrong");
    }
    const Json body = Json::parse(request.body, nullptr, false);
    if (!body.is_object() || body.value("do", Json()) != "end") {
      return answer(response, 400, "give {\"do\":\"end\"}");
    }
    content.end_run();
    answer(response, 200, "the run ends");
  }

  WebAddress address;
  WebContent content;
  std::atomic<int> event_streams = 0, video_streams = 0;
  std::atomic<u64> refused = 0;
  Listener server{kMostHead + kMostBody};
  std::thread thread;
};

WebServer::WebServer(const WebAddress& address, WebContent content)
    : impl_(std::make_unique<Impl>(address, std::move(content))) {
  impl_->set_up();
  WebAddress& bound = impl_->address;
  if (bound.port == 0) {
    bound.port = impl_->server.bind_to_any_port(bound.host);
  } else if (!impl_->server.bind_to_port(bound.host, bound.port)) {
    bound.port = -1;
  }
  if (bound.port <= 0) {
    throw Error(
        fmt::format("{} {}:{}: cannot be listened on: another program does, or the address is not this "
                    "machine's; give another port, or 0 for any",
                    address.option, address.host, address.port));
  }
  impl_->server.widen_queue(kMostConnections);
  impl_->thread = std::thread([this] {
    become_a_servant(impl_->gives_way());
    impl_->server.listen_after_bind();
  });
  // The library's stop does nothing before it listens.
  while (!impl_->server.is_running()) std::this_thread::sleep_for(milliseconds(1));
}

WebServer::~WebServer() {
  impl_->content.feed->close();
  impl_->server.stop();
  impl_->thread.join();
}

int WebServer::port() const { return impl_->address.port; }

std::string WebServer::url() const {
  const WebAddress& address = impl_->address;
  const bool is_v6 = address.host.find(':') != std::string::npos;
  return fmt::format(is_v6 ? "http://[{}]:{}/" : "http://{}:{}/", address.host, address.port);
}

int WebServer::event_streams() const { return impl_->event_streams; }
int WebServer::video_streams() const { return impl_->video_streams; }
u64 WebServer::refused() const { return impl_->refused; }

}  // namespace berth::cli
