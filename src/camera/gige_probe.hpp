#pragma once

#include <string>

namespace berth {

/// Whether a GigE Vision camera answers at that IPv4 address ("192.168.1.5"), asked once and waited for so long. It
/// says nothing of whether the camera can be had.
bool answers_gige(const std::string& address, int timeout_ms);

}  // namespace berth
