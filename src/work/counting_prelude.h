// The dialect as C++ whose integers count (counted.hpp): one call runs one work-group. Included once, by
// count_step.cpp.
#define GROUP_SIZE 128

#define FN static inline
#define KERNEL(name) static void name([[maybe_unused]] const ::berth::work::counted::Word<::berth::s32> group_,
#define IN(i, T, x) ::berth::work::counted::Input<T::Plain> x,
#define OUT(i, T, x) ::berth::work::counted::Output<T::Plain> x,
#define INOUT(i, T, x) ::berth::work::counted::Output<T::Plain> x,
#define PARAMS(name) const name##_params& p) {
#define LANES_IF(condition)
#define STRIDE_IF(condition)
#define SHARED(T, x, k) ::berth::work::counted::Shared<T, k> x;
#define BODY
#define END }
#define EACH_ITEM for (::berth::work::counted::Phase items_(GROUP_SIZE); items_.next();) {
#define EACH_END }
#define FIRST_ITEMS(n) for (::berth::work::counted::Phase items_(n); items_.next();)
#define BARRIER
#define LID items_.at()
#define GROUP group_
// Known to an item at no cost, as on a GPU.
#define GID ::berth::work::counted::Word<::berth::s32>(group_.value * GROUP_SIZE + items_.at().value)

#define ATOMIC_ADD(x, v) (x) += (v)
#define ATOMIC_MAX(x, v) (x) = max(x, v)
#define ATOMIC_MIN(x, v) (x) = min(x, v)

#define U32(x) ::berth::work::counted::as_unsigned(x)
#define S32(x) ::berth::work::counted::as_signed(x)
#define POPCOUNT(x) ::berth::work::counted::popcount(x)

// Counted whole, for machines that have them in one instruction.
#define BERTH_DOT_S8
#define BERTH_BYTES
