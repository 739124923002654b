#include <flyball/control/quadratic_cost.hpp>

#include <string>

#include <flyball/math/riccati.hpp>

#include "math/dense.hpp"

namespace flyball {

namespace {

/// The matrix of a weight, or its maker's error; symmetric, of the given size.
Expected<Eigen::MatrixXd> weight_of(const Weight& weight, Eigen::Index size, std::string_view where,
                                    std::string_view name, std::string_view meaning) {
  if (!weight.get()) {
    return tl::unexpected(weight.get().error());
  }
  const Eigen::MatrixXd& matrix = *weight.get();
  if (auto shape = check_shape(matrix, size, size, where, name, meaning); !shape) {
    return tl::unexpected(shape.error());
  }
  return check_all(check_finite(matrix, where, name), check_symmetric(matrix, where, name))
      .map([&] { return matrix; });
}

Expected<LqrDesign<>> solve_continuous(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                       const Weight& R, const Eigen::MatrixXd* N) {
  constexpr std::string_view where = "continuous_lqr";
  if (auto square = check_square(A, where, "A"); !square) {
    return tl::unexpected(square.error());
  }
  if (auto shape = check_shape(B, A.rows(), B.cols(), where, "B", "states x inputs"); !shape) {
    return tl::unexpected(shape.error());
  }
  const auto weight_Q = weight_of(Q, A.rows(), where, "Q", "states x states");
  if (!weight_Q) {
    return tl::unexpected(weight_Q.error());
  }
  const auto weight_R = weight_of(R, B.cols(), where, "R", "inputs x inputs");
  if (!weight_R) {
    return tl::unexpected(weight_R.error());
  }
  if (N != nullptr) {
    if (auto shape = check_shape(*N, A.rows(), B.cols(), where, "N", "states x inputs"); !shape) {
      return tl::unexpected(shape.error());
    }
  }
  auto solution =
      N == nullptr ? care(A, B, *weight_Q, *weight_R) : care(A, B, *weight_Q, *weight_R, *N);
  if (!solution) {
    return tl::unexpected(Error(std::move(solution.error()).in(std::string(where))));
  }
  return LqrDesign<>{std::move(solution->K), std::move(solution->X), std::move(solution->poles),
                     solution->residual, solution->condition};
}

}  // namespace

Expected<QuadraticCost> output_cost(const MatrixRef& C, const MatrixRef& D, const Weight& Q,
                                    const Weight& R) {
  constexpr std::string_view where = "output_cost";
  if (auto checked = check_all(check_shape(D, C.rows(), D.cols(), where, "D", "outputs x inputs"),
                               check_finite(C, where, "C"), check_finite(D, where, "D"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  const auto weight_Q = weight_of(Q, C.rows(), where, "Q", "outputs x outputs");
  if (!weight_Q) {
    return tl::unexpected(weight_Q.error());
  }
  const auto weight_R = weight_of(R, D.cols(), where, "R", "inputs x inputs");
  if (!weight_R) {
    return tl::unexpected(weight_R.error());
  }
  const Eigen::MatrixXd Q_C = detail::product(*weight_Q, C);
  const Eigen::MatrixXd Q_D = detail::product(*weight_Q, D);
  return QuadraticCost{detail::symmetrized(detail::transposed_product(C, Q_C)),
                       detail::symmetrized(detail::transposed_product(D, Q_D) + *weight_R),
                       detail::transposed_product(C, Q_D)};
}

Expected<QuadraticCost> implicit_model_cost(const MatrixRef& A, const MatrixRef& B,
                                            const MatrixRef& C, const MatrixRef& A_ref,
                                            const Weight& Q, const Weight& R) {
  constexpr std::string_view where = "implicit_model_cost";
  if (auto square = check_square(A, where, "A"); !square) {
    return tl::unexpected(square.error());
  }
  if (auto checked =
          check_all(check_shape(B, A.rows(), B.cols(), where, "B", "states x inputs"),
                    check_shape(C, C.rows(), A.rows(), where, "C", "followed states x states"),
                    check_shape(A_ref, C.rows(), C.rows(), where, "A_ref",
                                "followed states x followed states"),
                    check_finite(A, where, "A"), check_finite(B, where, "B"),
                    check_finite(C, where, "C"), check_finite(A_ref, where, "A_ref"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  // y₊ - z₊ = (CA - A_ref C) x + C B u is an output with feedthrough: (B.4) is (B.2) of it.
  auto cost =
      output_cost(detail::product(C, A) - detail::product(A_ref, C), detail::product(C, B), Q, R);
  if (!cost && cost.error().where() == "output_cost") {
    return tl::unexpected(Error(std::move(cost.error()).in(std::string(where))));
  }
  return cost;
}

Expected<ImplicitModel> implicit_model_following(const MatrixRef& A, const MatrixRef& B,
                                                 const MatrixRef& C, const MatrixRef& A_ref,
                                                 const MatrixRef& B_ref, const Weight& Q,
                                                 const Weight& R) {
  constexpr std::string_view where = "implicit_model_following";
  auto cost = implicit_model_cost(A, B, C, A_ref, Q, R);
  if (!cost) {
    return tl::unexpected(cost.error());
  }
  if (auto checked = check_all(
          check_shape(B_ref, C.rows(), B_ref.cols(), where, "B_ref", "followed states x inputs"),
          check_finite(B_ref, where, "B_ref"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  auto design = lqr(A, B, cost->Q, cost->R, cost->N);
  if (!design) {
    return tl::unexpected(Error(std::move(design.error()).in(std::string(where))));
  }
  const Eigen::MatrixXd reach = detail::product(C, B);
  ImplicitModel model{design->K, detail::solve_least_squares(reach, B_ref), std::move(*cost),
                      design->poles, 0.0};
  model.mismatch =
      (detail::product(C, A) - detail::product(A_ref, C) - detail::product(reach, model.K)).norm();
  return model;
}

Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                     const Weight& R) {
  return solve_continuous(A, B, Q, R, nullptr);
}

Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                     const Weight& R, const MatrixRef& N) {
  const Eigen::MatrixXd cross = N;
  return solve_continuous(A, B, Q, R, &cross);
}

}  // namespace flyball
