#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/math/expression/traced.hpp>
#include <flyball/systems/model.hpp>

namespace flyball {

/// A model's derivative as a tape: what proofs and generated code look into.
struct ModelTape {
  expression::Tape f;                ///< From [x; u] to dx/dt.
  std::vector<double> parameters{};  ///< Of the tape, in SI.
  Eigen::Index states = 0;           ///< n
  Eigen::Index inputs = 0;           ///< m
};

/// The tape of a model that is written over a generic scalar and does not branch on values; its
/// parameters become constants. Cost: one call of the derivative; allocates.
/// @param model  A mechanism, a LagrangianModel, a type of your own.
template <Model M>
[[nodiscard]] ModelTape model_tape(const M& model) {
  using expression::Traced;
  const Eigen::Index n = model.states();
  const Eigen::Index m = model.inputs();
  expression::TapeBuilder builder(static_cast<std::size_t>(n + m));
  StateOf<M, Traced> x(n);
  InputOf<M, Traced> u(m);
  for (Eigen::Index i = 0; i < n; ++i) {
    x(i) = Traced(builder, builder.input(static_cast<std::size_t>(i)));
  }
  for (Eigen::Index i = 0; i < m; ++i) {
    u(i) = Traced(builder, builder.input(static_cast<std::size_t>(n + i)));
  }
  const auto dxdt = model.derivative(x, u).eval();
  std::vector<expression::Slot> outputs;
  for (Eigen::Index i = 0; i < dxdt.size(); ++i) {
    outputs.push_back(dxdt(i).slot_on(builder));
  }
  return {.f = builder.finish(outputs), .parameters = {}, .states = n, .inputs = m};
}

}  // namespace flyball
