#include <flyball/math/expression/tape.hpp>

namespace flyball::expression {

template <>
void Tape::compute(std::size_t first, std::size_t last, double* values) const noexcept {
  const Node* const nodes = nodes_.data();
  for (std::size_t i = first; i < last; ++i) {
    const Node& node = nodes[i];
    values[i] = apply<double>(node.operation, values[node.a], values[node.b], values[node.c]);
  }
}

}  // namespace flyball::expression
