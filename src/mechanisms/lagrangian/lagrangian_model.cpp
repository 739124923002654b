#include <flyball/mechanisms/lagrangian/lagrangian_model.hpp>

#include <string>

#include <Eigen/Cholesky>

#include "core/try.hpp"

namespace flyball::mechanisms::detail {

namespace {

constexpr std::string_view in_lagrangian_model = "lagrangian_model";

std::vector<double> as_list(const Eigen::VectorXd& values) {
  return {values.begin(), values.end()};
}

}  // namespace

Expected<void> check_mechanics(const MechanicsSample& sample) {
  const auto refused = [&](ArgumentError code, std::string_view what) {
    return refusal(code, in_lagrangian_model, what)
        .with("q", as_list(sample.q))
        .with("v", as_list(sample.v));
  };
  if (!std::isfinite(sample.potential) || !sample.forces.allFinite()) {
    return refused(ArgumentError::not_finite, "the potential energy, or a force of it,")
        .got("not finite")
        .expected("finite where the mechanism can be");
  }
  if (!std::isfinite(sample.energy) || !sample.M.allFinite()) {
    return refused(ArgumentError::not_finite, "the kinetic energy, or its mass matrix,")
        .got("not finite")
        .expected("finite where the mechanism can be");
  }
  constexpr double rounding = 1e-9;
  const double quadratic = 0.5 * sample.v.dot(sample.M * sample.v);
  const double scale = std::abs(sample.energy) + std::abs(quadratic) +
                       1e-3 * std::abs(sample.potential) + std::abs(sample.doubled_energy);
  if (std::abs(sample.energy - quadratic) > rounding * scale ||
      std::abs(sample.doubled_energy - 4.0 * sample.energy) > rounding * scale) {
    return refused(ArgumentError::out_of_range, "the kinetic energy")
        .got(std::to_string(sample.energy) + " J where ½ vᵀMv is " + std::to_string(quadratic))
        .expected("a quadratic form of the rates, ½ vᵀM(q)v")
        .hint("write what is moved by a motor of its own as an input");
  }
  constexpr double least = 1e-13;
  const Eigen::Index n = sample.M.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    // The Schur complement of the leading block: what inertia the coordinate has on its own.
    Eigen::MatrixXd leading = sample.M.topLeftCorner(i + 1, i + 1);
    const double own = leading(i, i);
    double rest = own;
    if (i > 0) {
      const Eigen::VectorXd coupling = leading.col(i).head(i);
      rest -= coupling.dot(leading.topLeftCorner(i, i).llt().solve(coupling));
    }
    if (!(own > 0.0) || !(rest > least * own)) {
      return refused(ArgumentError::not_positive, "the mass matrix")
          .got("not positive definite: coordinate " + std::to_string(i + 1) +
               (i > 0 ? " moves nothing that those before it do not move" : " moves no mass"))
          .expected("positive definite")
          .hint("give the link that it turns a mass or a moment of inertia")
          .with("its inertia", {own, rest});
    }
  }
  return {};
}

}  // namespace flyball::mechanisms::detail
