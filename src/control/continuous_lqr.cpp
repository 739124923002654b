#include <flyball/control/continuous_lqr.hpp>

#include <flyball/control/integral_control.hpp>

#include "control/weights.hpp"
#include "core/try.hpp"

namespace flyball {

Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                     const Weight& R) {
  return detail::solve_lqr(A, B, Q, R, nullptr, TimeDomain::continuous);
}

Expected<LqrDesign<>> continuous_lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                     const Weight& R, const MatrixRef& N) {
  const Eigen::MatrixXd cross = N;
  return detail::solve_lqr(A, B, Q, R, &cross, TimeDomain::continuous);
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
