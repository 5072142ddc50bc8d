#pragma once

#include <string>

namespace berth::cli {

/// Where a page is served.
struct WebAddress {
  std::string host = "127.0.0.1";
  int port = 8040;
  /// What it was given by, for messages.
  const char* option = "--view";
};

/// Given by that option: "HOST:PORT", "HOST", ":PORT" or "PORT"; "[::1]:8040" for IPv6; port 0 takes any that is free.
/// Throws Error that names the value and the remedy.
WebAddress parse_web_address(const std::string& text, const char* option = "--view");

/// Whether a request's Host is one of this machine's: an address, localhost, its name, or that with ".local". Others
/// are a stranger's page that made its own name point here.
bool is_own_name(std::string host);

}  // namespace berth::cli
