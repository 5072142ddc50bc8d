// The dialect as GLSL 4.50 for Vulkan: buffer i is binding i, parameters are push constants. One operation a shader.
//   BERTH_NO_SHARED    for texts without SHARED: nothing to wait for
//   BERTH_LANE_GROUPS  for processors: an invocation runs a whole group, item by item as in cpu.h. The lanes of a
//                      vector are groups then, a phase of one item costs one turn, and no phase needs a barrier. An
//                      invocation may make 65535 turns of loops in all (Mesa's llvmpipe leaves them then, silently):
//                      only for texts that say LANES_IF, and while it holds
#define GROUP_SIZE 128
#define u32 uint
#define s32 int

// clang-format off
#define FN
#define IN(i, T, x) layout(std430, set = 0, binding = i) readonly buffer B##i { T x[]; };
#define OUT(i, T, x) layout(std430, set = 0, binding = i) buffer B##i { T x[]; };
#define INOUT(i, T, x) OUT(i, T, x)

#define LANES_IF(condition)

#ifdef BERTH_LANE_GROUPS
#define KERNEL(name) layout(local_size_x = BERTH_LANE_GROUPS) in;
#define PARAMS(name) layout(push_constant) uniform Params { name##_params p; int groups_; };
#define SHARED(T, x, k) T x[k];
#define BODY void main() { if (GROUP < groups_) {
#define END }}
#define EACH_ITEM for (int lid_ = 0; lid_ < GROUP_SIZE; ++lid_) {
#define FIRST_ITEMS(n) for (int lid_ = 0; lid_ < (n); ++lid_)
#define BARRIER
#define LID lid_
#define GROUP int(gl_GlobalInvocationID.x)
#define GID (GROUP * GROUP_SIZE + LID)
#define ATOMIC_ADD(x, v) (x) += (v)
#define ATOMIC_MAX(x, v) (x) = max(x, v)
#define ATOMIC_MIN(x, v) (x) = min(x, v)
#else
#define KERNEL(name) layout(local_size_x = GROUP_SIZE) in;
#define PARAMS(name) layout(push_constant) uniform Params { name##_params p; };
#define SHARED(T, x, k) shared T x[k];
#define BODY void main() {
#define END }
#define EACH_ITEM {
#define FIRST_ITEMS(n) if (LID < (n))
#ifdef BERTH_NO_SHARED
#define BARRIER
#else
#define BARRIER memoryBarrierShared(); barrier()
#endif
#define LID int(gl_LocalInvocationID.x)
#define GROUP int(gl_WorkGroupID.x)
#define GID int(gl_GlobalInvocationID.x)
// On shared memory only.
#define ATOMIC_ADD(x, v) atomicAdd(x, v)
#define ATOMIC_MAX(x, v) atomicMax(x, v)
#define ATOMIC_MIN(x, v) atomicMin(x, v)
#endif
#define EACH_END } BARRIER;
// clang-format on

#define U32(x) uint(x)
#define S32(x) int(x)
#define POPCOUNT(x) uint(bitCount(x))
