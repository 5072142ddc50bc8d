// The dialect as GLSL 4.50 for Vulkan: buffer i is binding i, parameters are push constants. One operation a shader.
#define GROUP_SIZE 128
#define u32 uint
#define s32 int

#define FN
#define KERNEL(name) layout(local_size_x = GROUP_SIZE) in;
#define IN(i, T, x) \
  layout(std430, set = 0, binding = i) readonly buffer B##i { T x[]; };
#define OUT(i, T, x) \
  layout(std430, set = 0, binding = i) buffer B##i { T x[]; };
#define INOUT(i, T, x) OUT(i, T, x)
#define PARAMS(name) \
  layout(push_constant) uniform Params { name##_params p; };
#define SHARED(T, x, k) shared T x[k];
#define BODY void main() {
#define END }
#define EACH_ITEM {
#define EACH_END         \
  }                      \
  memoryBarrierShared(); \
  barrier();
#define LID int(gl_LocalInvocationID.x)
#define GROUP int(gl_WorkGroupID.x)
#define GID int(gl_GlobalInvocationID.x)

// On shared memory only.
#define ATOMIC_ADD(x, v) atomicAdd(x, v)
#define ATOMIC_MAX(x, v) atomicMax(x, v)
#define ATOMIC_MIN(x, v) atomicMin(x, v)

#define U32(x) uint(x)
#define S32(x) int(x)
#define POPCOUNT(x) uint(bitCount(x))
