// The dialect as OpenCL C 1.2.
#define GROUP_SIZE 128
typedef uint u32;
typedef int s32;

#define FN static inline
// Prefixed, because the language has functions of its own that are called like operations (normalize).
#define KERNEL(name) __kernel __attribute__((reqd_work_group_size(GROUP_SIZE, 1, 1))) void berth_##name(
#define IN(i, T, x) __global const T *restrict x,
#define OUT(i, T, x) __global T *restrict x,
#define INOUT(i, T, x) __global T *restrict x,
#define PARAMS(name) const struct name##_params p) {
#define LANES_IF(condition)
#define STRIDE_IF(condition)
#define SHARED(T, x, k) __local T x[k];
#define BODY
#define END }
#define EACH_ITEM {
#define BARRIER barrier(CLK_LOCAL_MEM_FENCE)
#define EACH_END \
  }              \
  BARRIER;
#define FIRST_ITEMS(n) if (LID < (n))
#define LID ((int)get_local_id(0))
#define GROUP ((int)get_group_id(0))
#define GID ((int)get_global_id(0))

// On shared memory only.
#define ATOMIC_ADD(x, v) atomic_add(&(x), v)
#define ATOMIC_MAX(x, v) atomic_max(&(x), v)
#define ATOMIC_MIN(x, v) atomic_min(&(x), v)

#define U32(x) ((u32)(x))
#define S32(x) ((s32)(x))
#define POPCOUNT(x) popcount(x)
