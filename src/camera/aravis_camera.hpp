#pragma once

#include <memory>
#include <string>
#include <vector>

#include "camera/live_camera.hpp"

namespace berth {

/// What a GigE Vision or USB3 Vision camera is set to; 0 (or less where 0 means something, or empty) leaves it as it
/// is.
struct AravisOptions {
  /// Its serial number, or whatever else Aravis knows it by: "VENDOR-SERIAL", a name given to it, an address.
  std::string name;
  int width = 0, height = 0;
  /// Left upper corner on the sensor, with width and height.
  int x = 0, y = 0;
  double fps = 0;
  /// GenICam's name, e.g. "Mono8"; empty picks the first the camera has of those that aravis_formats() lists.
  std::string format;
  /// Given, the camera's own control of it is switched off.
  int exposure_us = -1;
  /// As the camera counts it, mostly dB; given, the camera's own control of it is switched off.
  double gain = -1;
  /// The input whose rising edge begins a frame, e.g. "Line1".
  std::string trigger;
  /// Of the network, bytes with its headers.
  int packet_size = 0;
  int buffers = 8;
  /// A frame of which packets are missing is waited for this long, ms; 0: two of its periods.
  double retention_ms = 0;
  /// Missing packets are asked for again.
  bool resend = true;
  /// Over Ethernet, packets are taken from a packet socket's ring (CAP_NET_RAW) in place of an ordinary socket.
  bool packet_socket = false;
  /// What a frame's time is on.
  enum class Time {
    /// When its first packet came here.
    host,
    /// The camera's own clock.
    camera,
    /// The camera's own clock, which it sets by PTP; it must be slave when frames begin.
    ptp,
  } time = Time::host;
  /// Of the camera's times, the one in the chunk data at a frame's end in place of the one in its leader.
  bool chunk_time = false;
  int watchdog_ms = 1000;
  /// LiveOptions::repeats
  bool repeats = false;
};

/// Options of a source's name without "aravis:": "CAMERA[,KEY=VALUE...]". Throws Error that names the key, its value
/// and the remedy.
AravisOptions parse_aravis(const std::string& text);

/// GenICam's names of the pixel formats that can be read, best first.
std::vector<std::string> aravis_formats();

/// Opens the camera and has it stream; once found, it is opened again without looking for it among all there are.
/// What it throws begins "aravis:NAME: ", also where Berth was built without Aravis.
LiveCameraOpener aravis_opener(const AravisOptions& options);

/// The cameras there are now, as --source takes them, sorted; takes a second. None where Berth was built without
/// Aravis.
std::vector<std::string> list_aravis_cameras();

}  // namespace berth
