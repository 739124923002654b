#include <flyball/control/implicit_model_following.hpp>

#include <string>

#include <flyball/math/riccati/riccati.hpp>

#include "control/placement.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

Expected<QuadraticCost> implicit_model_cost(const MatrixRef& A, const MatrixRef& B,
                                            const MatrixRef& C, const MatrixRef& A_ref,
                                            const Weight& Q, const Weight& R) {
  constexpr std::string_view where = "implicit_model_cost";
  FLYBALL_CHECK(Checks(where)
                    .square(A, "A")
                    .shape(B, A.rows(), B.cols(), "B", "states x inputs")
                    .shape(C, C.rows(), A.rows(), "C", "followed states x states")
                    .shape(A_ref, C.rows(), C.rows(), "A_ref", "followed states x followed states")
                    .finite(A, "A")
                    .finite(B, "B")
                    .finite(C, "C")
                    .finite(A_ref, "A_ref"));
  // y₊ - z₊ = (CA - A_ref C) x + C B u is an output with feedthrough: (B.4) is (B.2) of it.
  auto cost =
      output_cost(detail::product(C, A) - detail::product(A_ref, C), detail::product(C, B), Q, R);
  if (!cost && cost.error().where() == "output_cost") {
    return tl::unexpected(Error(std::move(cost.error()).in(std::string(where))));
  }
  return cost;
}

namespace {

/// The gain of least cost. The reference model's modes that are on the unit circle or outside it,
/// such as a position, cost nothing where the plant already follows them: they are left alone,
/// where a stabilising regulator would have no answer.
Expected<Eigen::MatrixXd> following_gain(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                         const MatrixRef& A_ref, const Eigen::MatrixXd& Q,
                                         const Eigen::MatrixXd& R, const QuadraticCost& cost) {
  if (!detail::cholesky_of(cost.R)) {
    return refusal(RiccatiError::singular, {}, "R + (CB)'Q(CB)")
        .got("not positive definite")
        .hint("give every input a weight in R");
  }
  // Completing the square: u = -R⁻¹Nᵀx + u' leaves A - BR⁻¹Nᵀ and the cost Q - NR⁻¹Nᵀ.
  const Eigen::MatrixXd shift = detail::solve_symmetric(cost.R, cost.N.transpose());
  const Eigen::MatrixXd A_shifted = A - detail::product(B, shift);
  Eigen::MatrixXd Q_shifted = detail::symmetrized(cost.Q - detail::product(cost.N, shift));
  const detail::SymmetricEigensystem weights = detail::symmetric_eigensystem_of(Q);
  if (detail::cholesky_of(R) && weights.values.minCoeff() >= -1e-12 * weights.values.maxCoeff()) {
    // Eᵀ(I + F R⁻¹ Fᵀ)⁻¹E with Q = WᵀW, E = W(CA - A_ref C) and F = WCB: without the difference of
    // what is nearly equal when the plant can follow.
    const Eigen::MatrixXd W =
        weights.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * weights.vectors.transpose();
    const Eigen::MatrixXd E = detail::product(W, detail::product(C, A) - detail::product(A_ref, C));
    const Eigen::MatrixXd F = detail::product(W, detail::product(C, B));
    const Eigen::MatrixXd inner = Eigen::MatrixXd::Identity(W.rows(), W.rows()) +
                                  detail::product(F, detail::solve_symmetric(R, F.transpose()));
    Q_shifted = detail::symmetrized(
        detail::transposed_product(E, detail::solve_symmetric(detail::symmetrized(inner), E)));
  }
  auto solution = dare(A_shifted, B, Q_shifted, cost.R);
  if (solution) {
    return Eigen::MatrixXd(solution->K + shift);
  }
  // Only what the cost sees: by duality the controllable part of the transposed pair.
  const detail::ControllableStaircase seen =
      detail::controllable_staircase(A_shifted.transpose(), Q_shifted);
  const Eigen::Index n = seen.controllable;
  if (n == A.rows()) {
    return tl::unexpected(std::move(solution).error());
  }
  if (n == 0) {
    return shift;
  }
  const Eigen::MatrixXd basis = seen.Q.leftCols(n);
  const Eigen::MatrixXd Q_seen =
      detail::symmetrized(detail::transposed_product(basis, detail::product(Q_shifted, basis)));
  FLYBALL_TRY(const auto part, dare(seen.A.topLeftCorner(n, n).transpose(),
                                    detail::transposed_product(basis, B), Q_seen, cost.R));
  return Eigen::MatrixXd(detail::product_transposed(part.K, basis) + shift);
}

}  // namespace

Expected<ImplicitModel> implicit_model_following(const MatrixRef& A, const MatrixRef& B,
                                                 const MatrixRef& C, const MatrixRef& A_ref,
                                                 const MatrixRef& B_ref, const Weight& Q,
                                                 const Weight& R) {
  constexpr std::string_view where = "implicit_model_following";
  FLYBALL_TRY(auto cost, implicit_model_cost(A, B, C, A_ref, Q, R));
  FLYBALL_CHECK(Checks(where)
                    .shape(B_ref, C.rows(), B_ref.cols(), "B_ref", "followed states x inputs")
                    .finite(B_ref, "B_ref"));
  FLYBALL_TRY_IN(where, const auto K, following_gain(A, B, C, A_ref, *Q.get(), *R.get(), cost));
  const Eigen::MatrixXd reach = detail::product(C, B);
  ImplicitModel model{K, detail::solve_least_squares(reach, B_ref), std::move(cost),
                      detail::eigenvalues_of(A - detail::product(B, K)), 0.0};
  model.mismatch =
      (detail::product(C, A) - detail::product(A_ref, C) - detail::product(reach, model.K)).norm();
  return model;
}

}  // namespace flyball
