// Words that the run operations share. The macros name the buffers of the body that uses them.

// The id of the first run end at or after a word of bits; word may be one past the last.
#define RUN_ENDS_BEFORE(word) (offsets[word] + offsets[p.base_at + (word) / GROUP_SIZE])

// Where bits change: bit i is set when pixel i differs from the one before it.
FN u32 run_edges(u32 here, u32 before) { return here ^ ((here << 1) | (before >> 31)); }
#define RUN_EDGES(row, x) run_edges(bits[(row)*p.row_words + (x)], (x) > 0 ? bits[(row)*p.row_words + (x)-1] : 0u)

// The lowest n bits of a word, n from 0 to 32.
FN u32 bits_below(int n) { return n == 0 ? 0u : (2u << (n - 1)) - 1u; }
FN int lowest_bit(u32 word) { return S32(POPCOUNT((word & (0u - word)) - 1u)); }

// A node's crack and the step to its successor.
FN int node_x(u32 node) { return S32(node & 0xffffu); }
FN int node_step(u32 node) { return S32(node) >> 16; }
FN u32 make_node(u32 x, int step) { return x | (U32(step) << 16); }
// Rows from a node to its successor: starts go up, ends go down, steps by an odd number stay in the row.
FN int node_descent(int id, int step) { return (step & 1) != 0 ? 0 : ((id & 1) != 0 ? 1 : -1); }
