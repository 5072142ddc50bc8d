#pragma once

#include <atomic>
#include <type_traits>

#include "vulkan/instance.hpp"

namespace berth::vulkan {

/// Takes the place of one of Api's functions: counts its calls, and makes them fail from a chosen one on.
///   Hook<&Api::vkAllocateMemory>::install(api)     in Instruments::adapt
template <auto Member>
struct Hook;

template <class Result, class... Arguments, Result (*Api::*Member)(Arguments...)>
struct Hook<Member> {
  static inline Result (*real)(Arguments...) = nullptr;
  static inline std::atomic<int> calls{0};
  static inline std::atomic<int> good_calls{-1};  // before it fails; negative for never
  static inline VkResult failure = VK_SUCCESS;

  static void install(Api& api) {
    real = api.*Member;
    calls = 0;
    good_calls = -1;
    api.*Member = &call;
  }
  /// From now on the first `good` calls are as ever, all later ones fail.
  static void fail_after(int good, VkResult result) {
    calls = 0;
    failure = result;
    good_calls = good;
  }
  static Result call(Arguments... arguments) {
    const int before = calls++;
    if constexpr (std::is_same_v<Result, VkResult>) {
      if (good_calls >= 0 && before >= good_calls) return failure;
    }
    return real(arguments...);
  }
};

}  // namespace berth::vulkan
