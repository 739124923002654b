#include <flyball/control/continuous_lqr.hpp>

#include <string>

#include <flyball/control/integral_control.hpp>
#include <flyball/math/riccati/riccati.hpp>

#include "control/weights.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

Expected<LqrDesign<>> solve_continuous(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                       const Weight& R, const Eigen::MatrixXd* N) {
  constexpr std::string_view where = "continuous_lqr";
  FLYBALL_CHECK(Checks(where).square(A, "A").shape(B, A.rows(), B.cols(), "B", "states x inputs"));
  FLYBALL_TRY(const auto weight_Q, detail::weight_of(Q, A.rows(), where, "Q", "states x states"));
  FLYBALL_TRY(const auto weight_R, detail::weight_of(R, B.cols(), where, "R", "inputs x inputs"));
  if (N != nullptr) {
    FLYBALL_CHECK(check_shape(*N, A.rows(), B.cols(), where, "N", "states x inputs"));
  }
  auto solution =
      N == nullptr ? care(A, B, weight_Q, weight_R) : care(A, B, weight_Q, weight_R, *N);
  if (!solution) {
    return tl::unexpected(Error(std::move(solution.error()).in(std::string(where))));
  }
  return LqrDesign<>{std::move(solution->K), std::move(solution->X), std::move(solution->poles),
                     solution->residual, solution->condition};
}

}  // namespace

Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                     const Weight& R) {
  return solve_continuous(A, B, Q, R, nullptr);
}

Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                     const Weight& R, const MatrixRef& N) {
  const Eigen::MatrixXd cross = N;
  return solve_continuous(A, B, Q, R, &cross);
}

Expected<IntegralLqr> continuous_lqi(const ContinuousSystem<>& plant, const Weight& Q,
                                     const Weight& R) {
  constexpr std::string_view where = "continuous_lqi";
  FLYBALL_CHECK(check_system(plant, where));
  return detail::integral_plant(plant.A, plant.B, plant.C, plant.D, 1.0, 0.0, Q, where)
      .and_then([&](const detail::IntegralPlant& augmented) {
        return detail::split_integral(continuous_lqr(augmented.A, augmented.B, Q, R),
                                      plant.A.rows(), where);
      });
}

}  // namespace flyball
