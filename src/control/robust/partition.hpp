#pragma once

#include <string_view>

#include <Eigen/Core>

#include <flyball/systems/system.hpp>

namespace flyball::detail {

/// The matrices of a discrete system, for what does not ask how long its period is, and back.
[[nodiscard]] inline ContinuousSystem<> bare(const DiscreteSystem<>& s) {
  return {s.A, s.B, s.C, s.D};
}
[[nodiscard]] inline DiscreteSystem<> timed(const ContinuousSystem<>& s, Time period) {
  return {s.A, s.B, s.C, s.D, period};
}

/// The blocks of a generalised plant, named as in the literature.
struct Partition {
  Eigen::MatrixXd A, B1, B2, C1, C2, D11, D12, D21, D22;
  Eigen::Index n = 0;
};
[[nodiscard]] Partition partition(const ContinuousSystem<>& system, Eigen::Index measurements,
                                  Eigen::Index controls);

/// A well-formed system that has as many, and others besides.
[[nodiscard]] Expected<void> check_generalized(const ContinuousSystem<>& system,
                                               Eigen::Index measurements, Eigen::Index controls,
                                               std::string_view where);

/// F_l(P, K). @errors SystemError::algebraic_loop.
[[nodiscard]] Expected<ContinuousSystem<>> closed(const Partition& plant,
                                                  const ContinuousSystem<>& controller,
                                                  std::string_view where);

}  // namespace flyball::detail
