// The dialect as GLSL 4.50 for Vulkan: buffer i is binding i, parameters are push constants. One operation a shader.
//   BERTH_NO_SHARED    for texts without SHARED: nothing to wait for
//   BERTH_LANE_GROUPS  for processors, where the text says LANES_IF: an invocation runs a whole group, item by item as
//                      in cpu.h. The lanes of a vector are groups then, a phase of one item costs one turn, and no
//                      phase needs a barrier
//   BERTH_STRIDE       for processors, where the text says STRIDE_IF: a group is that many invocations, a vector, and
//                      each runs every so-manieth item; for texts whose items may need too many turns for a whole group
// An invocation may make 65535 turns of loops in all (Mesa's llvmpipe leaves them then, silently): the condition says
// for which parameters it makes fewer.
#define GROUP_SIZE 128
#define u32 uint
#define s32 int

// clang-format off
#define FN
#define IN(i, T, x) layout(std430, set = 0, binding = i) readonly buffer B##i { T x[]; };
#define OUT(i, T, x) layout(std430, set = 0, binding = i) buffer B##i { T x[]; };
#define INOUT(i, T, x) OUT(i, T, x)

#define LANES_IF(condition)
#define STRIDE_IF(condition)

// Work-groups come in columns of neighbours, so that a processor, whose threads take whole rows of them, shares out
// evenly what lies together: the kernels' work is where the counts of contours and runs have not ended. A GPU's
// columns are one high.
#define WORK_GROUP_ int(gl_WorkGroupID.x * gl_NumWorkGroups.y + gl_WorkGroupID.y)
#define PARAMS(name) layout(push_constant) uniform Params { name##_params p; int groups_; };
#define BODY void main() { if (GROUP < groups_) {
#define END }}
#define GID (GROUP * GROUP_SIZE + LID)

#ifdef BERTH_LANE_GROUPS
#define KERNEL(name) layout(local_size_x = BERTH_LANE_GROUPS) in;
#define SHARED(T, x, k) T x[k];
#define EACH_ITEM for (int lid_ = 0; lid_ < GROUP_SIZE; ++lid_) {
#define FIRST_ITEMS(n) for (int lid_ = 0; lid_ < (n); ++lid_)
#define BARRIER
#define LID lid_
#define GROUP (WORK_GROUP_ * BERTH_LANE_GROUPS + int(gl_LocalInvocationID.x))
#define ATOMIC_ADD(x, v) (x) += (v)
#define ATOMIC_MAX(x, v) (x) = max(x, v)
#define ATOMIC_MIN(x, v) (x) = min(x, v)
#else
#define SHARED(T, x, k) shared T x[k];
#ifdef BERTH_STRIDE
#define KERNEL(name) layout(local_size_x = BERTH_STRIDE) in;
#define EACH_ITEM FIRST_ITEMS(GROUP_SIZE) {
#define FIRST_ITEMS(n) for (int lid_ = int(gl_LocalInvocationID.x); lid_ < (n); lid_ += BERTH_STRIDE)
#define LID lid_
#else
#define KERNEL(name) layout(local_size_x = GROUP_SIZE) in;
#define EACH_ITEM {
#define FIRST_ITEMS(n) if (LID < (n))
#define LID int(gl_LocalInvocationID.x)
#endif
#ifdef BERTH_NO_SHARED
#define BARRIER
#else
#define BARRIER memoryBarrierShared(); barrier()
#endif
#define GROUP WORK_GROUP_
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
