#pragma once

#include <type_traits>

#include "work/counts.hpp"

/// Integers that count what is done with them: the types of the kernel text in counting_prelude.h.
namespace berth::work::counted {

/// What must be done one after the other before a value is known: loads from buffers, and steps of everything else.
struct Way {
  std::uint64_t loads = 0;
  std::uint64_t steps = 0;
};
/// The longer of two, each part by itself.
inline Way longer(const Way& a, const Way& b) {
  return {a.loads > b.loads ? a.loads : b.loads, a.steps > b.steps ? a.steps : b.steps};
}
/// Steps of a kind of work: what is quick counts one. Quotients are loops or long sequences everywhere, and the group's
/// own memory answers after four times as long as arithmetic on the GPUs described (24 against 6 cycles).
constexpr std::uint64_t steps_of(Kind kind) { return kind == Kind::divide ? 16 : kind == Kind::shared ? 4 : 1; }

/// Counts of the item at work, and its way. A thread counts one step at a time (count_step.cpp), and operators have no
/// other way to reach it.
struct Tally {
  Counts counts{};
  /// What must be done before anything that follows a comparison, and so a branch.
  Way floor;
  /// The longest way so far.
  Way longest;
};
inline thread_local Tally tally;

inline void count(Kind kind) { ++tally.counts[static_cast<std::size_t>(kind)]; }

/// A word, and the way to it.
template <class T>
struct Word {
  using Plain = T;
  T value{};
  Way way;

  Word() = default;
  /// Only from its own type, as in the dialect: no sign changes in passing.
  template <class V, class = std::enable_if_t<std::is_same_v<V, T>>>
  Word(V v) : value(v) {}  // NOLINT(google-explicit-constructor): literals become words
  Word(T v, const Way& known_after) : value(v), way(known_after) {}
};

/// Counts an operation on what came by `inputs`, and gives the way to its result.
inline Way after(Kind kind, const Way& inputs) {
  count(kind);
  const Way begun = longer(inputs, tally.floor);
  const Way way{begun.loads, begun.steps + steps_of(kind)};
  tally.longest = longer(tally.longest, way);
  return way;
}

/// Sums wrap on the way as the text's own do.
template <class T, class F>
Word<T> combine(Kind kind, const Word<T>& a, const Word<T>& b, F f) {
  return {static_cast<T>(f(static_cast<u32>(a.value), static_cast<u32>(b.value))), after(kind, longer(a.way, b.way))};
}
template <class T>
bool known(bool answer, const Word<T>& a, const Word<T>& b) {
  tally.floor = longer(tally.floor, after(Kind::shift, longer(a.way, b.way)));
  return answer;
}

// Non-template operators for each of the two types, so that a literal beside a word becomes one.
#define BERTH_COUNTED_ARITHMETIC(T)                                                                            \
  inline Word<T> operator+(const Word<T>& a, const Word<T>& b) {                                               \
    return combine(Kind::simple, a, b, [](u32 x, u32 y) { return x + y; });                                    \
  }                                                                                                            \
  inline Word<T> operator-(const Word<T>& a, const Word<T>& b) {                                               \
    return combine(Kind::simple, a, b, [](u32 x, u32 y) { return x - y; });                                    \
  }                                                                                                            \
  inline Word<T> operator&(const Word<T>& a, const Word<T>& b) {                                               \
    return combine(Kind::simple, a, b, [](u32 x, u32 y) { return x & y; });                                    \
  }                                                                                                            \
  inline Word<T> operator|(const Word<T>& a, const Word<T>& b) {                                               \
    return combine(Kind::simple, a, b, [](u32 x, u32 y) { return x | y; });                                    \
  }                                                                                                            \
  inline Word<T> operator^(const Word<T>& a, const Word<T>& b) {                                               \
    return combine(Kind::simple, a, b, [](u32 x, u32 y) { return x ^ y; });                                    \
  }                                                                                                            \
  inline Word<T> operator*(const Word<T>& a, const Word<T>& b) {                                               \
    return combine(Kind::multiply, a, b, [](u32 x, u32 y) { return x * y; });                                  \
  }                                                                                                            \
  inline Word<T> operator/(const Word<T>& a, const Word<T>& b) {                                               \
    return {a.value / b.value, after(Kind::divide, longer(a.way, b.way))};                                     \
  }                                                                                                            \
  inline Word<T> operator%(const Word<T>& a, const Word<T>& b) {                                               \
    return {a.value % b.value, after(Kind::divide, longer(a.way, b.way))};                                     \
  }                                                                                                            \
  inline Word<T> operator~(const Word<T>& a) { return a ^ Word<T>(static_cast<T>(-1)); }                       \
  inline bool operator==(const Word<T>& a, const Word<T>& b) { return known(a.value == b.value, a, b); }       \
  inline bool operator!=(const Word<T>& a, const Word<T>& b) { return known(a.value != b.value, a, b); }       \
  inline bool operator<(const Word<T>& a, const Word<T>& b) { return known(a.value < b.value, a, b); }         \
  inline bool operator>(const Word<T>& a, const Word<T>& b) { return known(a.value > b.value, a, b); }         \
  inline bool operator<=(const Word<T>& a, const Word<T>& b) { return known(a.value <= b.value, a, b); }       \
  inline bool operator>=(const Word<T>& a, const Word<T>& b) { return known(a.value >= b.value, a, b); }       \
  inline Word<T>& operator+=(Word<T>& a, const Word<T>& b) { return a = a + b; }                               \
  inline Word<T>& operator-=(Word<T>& a, const Word<T>& b) { return a = a - b; }                               \
  inline Word<T>& operator&=(Word<T>& a, const Word<T>& b) { return a = a & b; }                               \
  inline Word<T>& operator|=(Word<T>& a, const Word<T>& b) { return a = a | b; }                               \
  inline Word<T>& operator^=(Word<T>& a, const Word<T>& b) { return a = a ^ b; }                               \
  inline Word<T>& operator++(Word<T>& a) { return a = a + Word<T>(static_cast<T>(1)); }                        \
  inline Word<T>& operator--(Word<T>& a) { return a = a - Word<T>(static_cast<T>(1)); }                        \
  inline Word<T> min(const Word<T>& a, const Word<T>& b) {                                                     \
    return {b.value < a.value ? b.value : a.value, after(Kind::shift, longer(a.way, b.way))};                  \
  }                                                                                                            \
  inline Word<T> max(const Word<T>& a, const Word<T>& b) {                                                     \
    return {a.value < b.value ? b.value : a.value, after(Kind::shift, longer(a.way, b.way))};                  \
  }                                                                                                            \
  template <class S>                                                                                           \
  Word<T> operator<<(const Word<T>& a, const Word<S>& by) {                                                    \
    return {static_cast<T>(static_cast<u32>(a.value) << static_cast<u32>(by.value)),                           \
            after(Kind::shift, longer(a.way, by.way))};                                                        \
  }                                                                                                            \
  template <class S>                                                                                           \
  Word<T> operator>>(const Word<T>& a, const Word<S>& by) {                                                    \
    return {static_cast<T>(a.value >> static_cast<u32>(by.value)), after(Kind::shift, longer(a.way, by.way))}; \
  }                                                                                                            \
  inline Word<T> operator<<(const Word<T>& a, s32 by) { return a << Word<s32>(by); }                           \
  inline Word<T> operator>>(const Word<T>& a, s32 by) { return a >> Word<s32>(by); }                           \
  inline Word<T>& operator<<=(Word<T>& a, s32 by) { return a = a << by; }                                      \
  inline Word<T>& operator>>=(Word<T>& a, s32 by) { return a = a >> by; }                                      \
  template <class S>                                                                                           \
  Word<T> operator<<(T a, const Word<S>& by) {                                                                 \
    return Word<T>(a) << by;                                                                                   \
  }
BERTH_COUNTED_ARITHMETIC(u32)
BERTH_COUNTED_ARITHMETIC(s32)
#undef BERTH_COUNTED_ARITHMETIC
inline Word<s32> operator-(const Word<s32>& a) { return Word<s32>(0) - a; }
// The one mixture that the text has, in addresses.
inline Word<u32> operator+(const Word<s32>& a, const Word<u32>& b) {
  return Word<u32>(static_cast<u32>(a.value), a.way) + b;
}
// Of parameters and constants: known before the launch, so free.
inline s32 min(s32 a, s32 b) { return b < a ? b : a; }
inline s32 max(s32 a, s32 b) { return a < b ? b : a; }

/// The two types hold the same bits: turning one into the other costs nothing.
template <class T>
Word<u32> as_unsigned(const Word<T>& a) {
  return {static_cast<u32>(a.value), a.way};
}
inline Word<u32> as_unsigned(s32 a) { return {static_cast<u32>(a)}; }
template <class T>
Word<s32> as_signed(const Word<T>& a) {
  return {static_cast<s32>(a.value), a.way};
}
inline Word<s32> as_signed(s32 a) { return {a}; }

inline Word<u32> popcount(const Word<u32>& a) {
  return {static_cast<u32>(__builtin_popcount(a.value)), after(Kind::popcount, a.way)};
}
inline Word<s32> dot_s8(const Word<u32>& a, const Word<u32>& b, const Word<s32>& sum) {
  u32 total = static_cast<u32>(sum.value);
  for (u32 at = 0; at < 32; at += 8) {
    total += static_cast<u32>(static_cast<s32>(static_cast<signed char>(a.value >> at)) *
                              static_cast<signed char>(b.value >> at));
  }
  return {static_cast<s32>(total), after(Kind::dot, longer(longer(a.way, b.way), sum.way))};
}
template <class F>
Word<u32> each_byte(const Word<u32>& a, const Word<u32>& b, F f) {
  u32 made = 0;
  for (u32 at = 0; at < 32; at += 8) made |= f((a.value >> at) & 255u, (b.value >> at) & 255u) << at;
  return {made, after(Kind::bytes, longer(a.way, b.way))};
}
inline Word<u32> bytes_ge(const Word<u32>& a, const Word<u32>& b) {
  return each_byte(a, b, [](u32 x, u32 y) { return x >= y ? 1u : 0u; });
}
inline Word<u32> bytes_min(const Word<u32>& a, const Word<u32>& b) {
  return each_byte(a, b, [](u32 x, u32 y) { return y < x ? y : x; });
}
inline Word<u32> bytes_max(const Word<u32>& a, const Word<u32>& b) {
  return each_byte(a, b, [](u32 x, u32 y) { return x < y ? y : x; });
}

/// A buffer's word. A load begins when its address is known and every branch before it has been taken.
template <class T>
Word<T> load(const T& from, const Way& address) {
  count(Kind::load);
  const Way begun = longer(address, tally.floor);
  const Way way{begun.loads + 1, begun.steps};
  tally.longest = longer(tally.longest, way);
  return {from, way};
}
template <class T>
class Place {
 public:
  Place(T* at, const Way& address) : at_(at), address_(address) {}
  Place(const Place&) = default;
  ~Place() = default;
  operator Word<T>() const { return load(*at_, address_); }  // NOLINT(google-explicit-constructor)
  Place& operator=(const Word<T>& word) {
    count(Kind::store);
    *at_ = word.value;
    return *this;
  }
  Place& operator=(const Place& other) {
    if (this != &other) *this = static_cast<Word<T>>(other);
    return *this;
  }

 private:
  T* at_;
  Way address_;
};
template <class T>
struct Output {
  T* words;
  template <class S>
  Place<T> operator[](const Word<S>& at) const {
    return {words + static_cast<std::size_t>(at.value), at.way};
  }
  Place<T> operator[](s32 at) const { return {words + at, {}}; }
};
template <class T>
struct Input {
  const T* words;
  template <class S>
  Word<T> operator[](const Word<S>& at) const {
    return load(words[static_cast<std::size_t>(at.value)], at.way);
  }
  Word<T> operator[](s32 at) const { return load(words[at], {}); }
};
/// A word of the group's memory. Reading it takes steps, whoever wrote it.
template <class W>
class Slot {
 public:
  Slot(W& word, const Way& address) : word_(word), address_(address) {}
  Slot(const Slot&) = default;
  ~Slot() = default;
  operator W() const { return {word_.value, after(Kind::shared, longer(word_.way, address_))}; }  // NOLINT
  Slot& operator=(const W& word) {
    count(Kind::shared);
    word_ = word;
    return *this;
  }
  Slot& operator=(const Slot& other) {
    if (this != &other) *this = static_cast<W>(other);
    return *this;
  }
  Slot& operator+=(const W& more) { return *this = static_cast<W>(*this) + more; }

 private:
  W& word_;
  Way address_;
};
template <class W>
Word<u32> as_unsigned(const Slot<W>& a) {
  return as_unsigned(static_cast<W>(a));
}
template <class W>
Word<s32> as_signed(const Slot<W>& a) {
  return as_signed(static_cast<W>(a));
}
template <class W, std::size_t N>
struct Shared {
  W words[N];
  template <class S>
  Slot<W> operator[](const Word<S>& at) {
    return {words[static_cast<std::size_t>(at.value)], at.way};
  }
  Slot<W> operator[](s32 at) { return {words[at], {}}; }
};

/// A step's way through its groups, phase by phase.
class Meter {
 public:
  void begin_group();
  void begin_phase();
  void begin_item();
  void end_item();
  void end_phase();
  void end_group();
  const StepWork& work() const { return work_; }

 private:
  void close_lockstep(std::size_t width);

  StepWork work_;
  Counts uniform_{};  // done by no item: once a group, by all of a lockstep's lanes
  int item_ = 0;
  Way group_floor_;
  std::uint64_t group_span_ = 0, group_all_ = 0, phase_span_ = 0;
  std::array<Counts, kLockstep.size()> longest_{};
};
inline thread_local Meter* meter = nullptr;

/// The items of a phase: `for (Phase items(n); items.next();)`.
class Phase {
 public:
  explicit Phase(s32 items) : items_(items) { meter->begin_phase(); }
  explicit Phase(const Word<s32>& items) : Phase(items.value) {}
  bool next() {
    if (at_ >= 0) meter->end_item();
    if (++at_ >= items_) {
      meter->end_phase();
      return false;
    }
    meter->begin_item();
    return true;
  }
  Word<s32> at() const { return {at_}; }

 private:
  s32 items_;
  s32 at_ = -1;
};

}  // namespace berth::work::counted
