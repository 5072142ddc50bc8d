#pragma once

#include <string>

#include "recorder.hpp"
#include "ros_options.hpp"
#include "stream.hpp"
#include "web_options.hpp"

namespace berth::cli {

/// All that `berth run` is asked for.
struct RunOptions {
  std::string source, config;
  StreamOptions stream;
  RecordOptions record;
  RosOptions ros;
  WebOptions web;
};

}  // namespace berth::cli
