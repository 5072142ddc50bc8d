// The dialect as CUDA C++14, which CUDA 10.2 still compiles: nvcc and NVRTC, or Clang for NVPTX without any CUDA
// headers (clang -x cuda -nocudainc -nocudalib), which then needs a few of their words from here.
#define GROUP_SIZE 128
typedef unsigned int u32;
typedef int s32;

#if defined(__clang__) && !defined(__NVCC__)
#define __global__ __attribute__((global))
#define __device__ __attribute__((device))
#define __shared__ __attribute__((shared))
#define __launch_bounds__(items) __attribute__((launch_bounds(items)))
#define LID ((int)__nvvm_read_ptx_sreg_tid_x())
#define GROUP ((int)__nvvm_read_ptx_sreg_ctaid_x())
#define POPCOUNT(x) ((u32)__builtin_popcount(x))
static inline __device__ s32 min(s32 a, s32 b) { return b < a ? b : a; }
static inline __device__ u32 min(u32 a, u32 b) { return b < a ? b : a; }
static inline __device__ s32 max(s32 a, s32 b) { return a < b ? b : a; }
static inline __device__ u32 max(u32 a, u32 b) { return a < b ? b : a; }
static inline __device__ void atomicAdd(s32* x, s32 v) { __nvvm_atom_add_gen_i(x, v); }
static inline __device__ void atomicAdd(u32* x, u32 v) { __nvvm_atom_add_gen_i((s32*)x, (s32)v); }
static inline __device__ void atomicMax(s32* x, s32 v) { __nvvm_atom_max_gen_i(x, v); }
static inline __device__ void atomicMax(u32* x, u32 v) { __nvvm_atom_max_gen_ui(x, v); }
static inline __device__ void atomicMin(s32* x, s32 v) { __nvvm_atom_min_gen_i(x, v); }
static inline __device__ void atomicMin(u32* x, u32 v) { __nvvm_atom_min_gen_ui(x, v); }
#else
#define LID ((int)threadIdx.x)
#define GROUP ((int)blockIdx.x)
#define POPCOUNT(x) ((u32)__popc(x))
#endif

#define FN static __device__ inline
// Names a host finds: not mangled, and prefixed as in opencl.h.
#define KERNEL(name) extern "C" __global__ void __launch_bounds__(GROUP_SIZE) berth_##name(
#define IN(i, T, x) const T* __restrict__ x,
#define OUT(i, T, x) T* __restrict__ x,
#define INOUT(i, T, x) T* __restrict__ x,
#define PARAMS(name) const name##_params p) {
#define LANES_IF(condition)
#define STRIDE_IF(condition)
#define SHARED(T, x, k) __shared__ T x[k];
#define BODY
#define END }
#define EACH_ITEM {
#define BARRIER __syncthreads()
#define EACH_END \
  }              \
  BARRIER;
#define FIRST_ITEMS(n) if (LID < (n))
#define GID (GROUP * GROUP_SIZE + LID)

// On shared memory only.
#define ATOMIC_ADD(x, v) atomicAdd(&(x), v)
#define ATOMIC_MAX(x, v) atomicMax(&(x), v)
#define ATOMIC_MIN(x, v) atomicMin(&(x), v)

#define U32(x) ((u32)(x))
#define S32(x) ((s32)(x))

// From compute capability 6.1 on one instruction is dot_s8 of tensor.h.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 610
#define BERTH_DOT_S8
FN s32 dot_s8(u32 a, u32 b, s32 acc) {
  s32 sum;
  asm("dp4a.s32.s32 %0, %1, %2, %3;" : "=r"(sum) : "r"(a), "r"(b), "r"(acc));
  return sum;
}
#endif
