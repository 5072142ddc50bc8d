#pragma once

// What all calls of include/berth.h do at the edge: exceptions end here, structs are copied as far as both sides know
// them.

#include <cstddef>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

#include "berth.h"
#include "berth/error.hpp"

namespace berth::c_api {

/// The caller broke a rule of berth.h.
class BadArgument : public Error {
 public:
  using Error::Error;
};

/// The device was lost with the frame.
class DeviceLost : public Error {
 public:
  using Error::Error;
};

/// Keeps the first failure: `error` may be null or hold one already. Cuts off a message that is too long.
void note(berth_error* error, berth_code code, const char* message) noexcept;

/// Runs `body` and says how it ended.
template <class Body>
berth_code guarded(berth_error* error, Body body) noexcept {
  berth_code code = BERTH_OK;
  try {
    body();
    return code;
  } catch (const BadArgument& failure) {
    note(error, code = BERTH_BAD_ARGUMENT, failure.what());
  } catch (const DeviceLost& failure) {
    note(error, code = BERTH_DEVICE_LOST, failure.what());
  } catch (const Error& failure) {
    note(error, code = BERTH_SETUP_FAILED, failure.what());
  } catch (const std::bad_alloc&) {
    note(error, code = BERTH_OUT_OF_MEMORY, "out of memory; use smaller images or fewer detectors");
  } catch (const std::exception& failure) {
    note(error, code = BERTH_INTERNAL_ERROR, failure.what());
  } catch (...) {
    note(error, code = BERTH_INTERNAL_ERROR, "something that is no std::exception was thrown");
  }
  return code;
}

/// The handle that `make` makes; null where it failed.
template <class Make>
auto opened(berth_error* error, Make make) noexcept -> decltype(make()) {
  decltype(make()) handle = nullptr;
  guarded(error, [&] { handle = make(); });
  return handle;
}

/// The argument, which must not be null.
template <class T>
T& needed(T* argument, const char* name) {
  if (argument == nullptr) throw BadArgument(std::string(name) + " is NULL");
  return *argument;
}

/// `first_size`: the struct's size in the first version of berth.h that has it.
template <class T>
std::size_t checked_size(const T& given, const char* name, std::size_t first_size) {
  if (given.struct_size >= first_size) return given.struct_size;
  throw BadArgument(std::string(name) + "->struct_size is " + std::to_string(given.struct_size) +
                    "; set it to sizeof the struct");
}

/// What the caller's struct says. Throws BadArgument where it comes from a later version and says more than is known.
template <class T>
T read_struct(const T* argument, const char* name, std::size_t first_size = sizeof(T)) {
  const T& given = needed(argument, name);
  const std::size_t size = checked_size(given, name, first_size);
  for (std::size_t i = sizeof(T); i < size; ++i) {
    if (reinterpret_cast<const unsigned char*>(&given)[i] != 0) {
      throw BadArgument(std::string(name) + " has members that this library, version " + berth_version() +
                        ", does not know; use a newer one, or leave them 0");
    }
  }
  T value{};
  std::memcpy(&value, &given, size < sizeof(T) ? size : sizeof(T));
  return value;
}

/// Copies into the caller's struct as much as it has room for, and 0 into what it has more.
template <class T>
void write_struct(T value, T* argument, const char* name, std::size_t first_size = sizeof(T)) {
  T& out = needed(argument, name);
  const std::size_t size = checked_size(out, name, first_size);
  value.struct_size = size;
  std::memcpy(&out, &value, size < sizeof(T) ? size : sizeof(T));
  if (size > sizeof(T)) std::memset(reinterpret_cast<unsigned char*>(&out) + sizeof(T), 0, size - sizeof(T));
}

}  // namespace berth::c_api
