// The dialect as C++: one call runs one work-group. EACH_ITEM is a loop over the group's items, so the end of a phase
// is the barrier; shared memory is an array on the stack. Needs berth/types.hpp first.
#define GROUP_SIZE 128

#define FN static inline
#define KERNEL(name) static void name([[maybe_unused]] const int group_,
#define IN(i, T, x) const T *x,
#define OUT(i, T, x) T *x,
#define INOUT(i, T, x) T *x,
#define PARAMS(name) const name##_params& p) {
#define LANES_IF(condition)
#define STRIDE_IF(condition)
#define SHARED(T, x, k) T x[k];
#define BODY
#define END }
#define EACH_ITEM for (int lid_ = 0; lid_ < GROUP_SIZE; ++lid_) {
#define EACH_END }
#define FIRST_ITEMS(n) for (int lid_ = 0; lid_ < (n); ++lid_)
#define BARRIER
#define LID lid_
#define GROUP group_
#define GID (group_ * GROUP_SIZE + lid_)

// One thread runs the whole group: no atomics needed on shared memory.
#define ATOMIC_ADD(x, v) (x) += (v)
#define ATOMIC_MAX(x, v) (x) = max(x, v)
#define ATOMIC_MIN(x, v) (x) = min(x, v)

#define U32(x) static_cast<u32>(x)
#define S32(x) static_cast<s32>(x)
#define POPCOUNT(x) static_cast<u32>(__builtin_popcount(x))

FN s32 min(s32 a, s32 b) { return b < a ? b : a; }
FN u32 min(u32 a, u32 b) { return b < a ? b : a; }
FN s32 max(s32 a, s32 b) { return a < b ? b : a; }
FN u32 max(u32 a, u32 b) { return a < b ? b : a; }
