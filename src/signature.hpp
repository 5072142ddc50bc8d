#pragma once

#include <type_traits>
#include <utility>
#include <vector>

#include "berth/ops.hpp"

/// From an operation's C++ function to what a backend needs: its argument table, and a call with untyped buffers.
namespace berth::signature {

template <class T>
constexpr Elem elem_of() {
  using Bare = std::remove_const_t<T>;
  static_assert(std::is_same_v<Bare, u32> || std::is_same_v<Bare, s32>, "device elements are u32 or s32");
  return std::is_same_v<Bare, u32> ? Elem::unsigned32 : Elem::signed32;
}

/// The buffer arguments of `void op(const P&, T*...)`.
template <class P, class... T>
std::vector<Arg> describe(void (*)(const P&, T*...)) {
  return {Arg{elem_of<T>(), std::is_const_v<T>}...};
}

namespace detail {
template <class P, class... T, std::size_t... I>
void call(void (*function)(const P&, T*...), const void* params, void* const* buffers, std::index_sequence<I...>) {
  function(*static_cast<const P*>(params), static_cast<T*>(buffers[I])...);
}
}  // namespace detail

/// Calls `void op(const P&, T*...)`, a whole operation.
template <class P, class... T>
void call(void (*function)(const P&, T*...), const void* params, void* const* buffers) {
  detail::call(function, params, buffers, std::index_sequence_for<T...>{});
}

}  // namespace berth::signature
