#include "berth/ops.hpp"

#include <array>
#include <cstring>

#include "berth/backend.hpp"
#include "berth/error.hpp"
#include "reference/reference.hpp"
#include "signature.hpp"

namespace berth {
namespace {

struct OpInfo {
  const char* name;
  std::size_t param_bytes;
  std::vector<Arg> args;
};

const OpInfo& info(Op op) {
  static const std::vector<OpInfo> table = {
#define X(op) {#op, sizeof(op##_params), signature::describe(&reference::op)},
      BERTH_OPS(X)
#undef X
  };
  return table[static_cast<std::size_t>(op)];
}

}  // namespace

const char* name_of(Op op) { return info(op).name; }
const std::vector<Arg>& args_of(Op op) { return info(op).args; }
std::size_t param_bytes(Op op) { return info(op).param_bytes; }

const std::vector<Op>& all_ops() {
  static const std::vector<Op> ops = {
#define X(op) Op::op,
      BERTH_OPS(X)
#undef X
  };
  return ops;
}

Step make_step(Op op, const void* params, std::initializer_list<Buffer*> buffers, int items) {
  if (buffers.size() != args_of(op).size()) {
    throw Error(std::string(name_of(op)) + " takes " + std::to_string(args_of(op).size()) + " buffers, not " +
                std::to_string(buffers.size()));
  }
  Step step{op, std::vector<std::byte>(param_bytes(op)), buffers, items};
  std::memcpy(step.params.data(), params, step.params.size());
  return step;
}

}  // namespace berth
