#include "web_address.hpp"

#include <arpa/inet.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "berth/error.hpp"

namespace berth::cli {

WebAddress parse_web_address(const std::string& text, const char* option) {
  WebAddress address;
  address.option = option;
  const auto complain = [&] {
    return Error(std::string(option) + " " + text +
                 ": give ADDRESS:PORT, e.g. 127.0.0.1:8040, or 0.0.0.0:8040 for every network");
  };
  if (text.empty()) return address;
  std::string host = text, port;
  const std::size_t bracket = text.rfind(']'), colon = text.rfind(':');
  if (text.front() == '[') {
    if (bracket == std::string::npos || (bracket + 1 < text.size() && colon != bracket + 1)) throw complain();
    host = text.substr(1, bracket - 1);
    if (bracket + 1 < text.size()) port = text.substr(bracket + 2);
  } else if (colon != std::string::npos) {
    host = text.substr(0, colon);
    port = text.substr(colon + 1);
    if (port.empty()) throw complain();
  } else if (text.find_first_not_of("0123456789") == std::string::npos) {
    host.clear();
    port = text;
  }
  if (!host.empty()) address.host = host;
  if (!port.empty()) {
    if (port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos) throw complain();
    address.port = std::stoi(port);
  }
  if (address.port > 65535 || address.host.find_first_of(" /[]") != std::string::npos) throw complain();
  return address;
}

bool is_own_name(std::string host) {
  if (!host.empty() && host.front() == '[') {
    host = host.substr(1, host.find(']') - 1);
  } else {
    host = host.substr(0, host.find(':'));
  }
  std::array<unsigned char, sizeof(in6_addr)> binary = {};
  if (inet_pton(AF_INET, host.c_str(), binary.data()) == 1 || inet_pton(AF_INET6, host.c_str(), binary.data()) == 1) {
    return true;
  }
  std::transform(host.begin(), host.end(), host.begin(), [](unsigned char c) { return std::tolower(c); });
  std::array<char, 256> name = {};
  gethostname(name.data(), name.size() - 1);
  std::string own = name.data();
  std::transform(own.begin(), own.end(), own.begin(), [](unsigned char c) { return std::tolower(c); });
  return host == "localhost" || (!own.empty() && (host == own || host == own + ".local"));
}

}  // namespace berth::cli
