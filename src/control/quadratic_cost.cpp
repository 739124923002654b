#include <flyball/control/quadratic_cost.hpp>

#include <string>

#include "control/weights.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace detail {

Expected<Eigen::MatrixXd> weight_of(const Weight& weight, Eigen::Index size, std::string_view where,
                                    std::string_view name, std::string_view meaning) {
  if (!weight.get()) {
    return tl::unexpected(weight.get().error());
  }
  const Eigen::MatrixXd& matrix = *weight.get();
  FLYBALL_CHECK(check_shape(matrix, size, size, where, name, meaning));
  return Checks(where).finite(matrix, name).symmetric(matrix, name).map([&] { return matrix; });
}

}  // namespace detail

Expected<QuadraticCost> output_cost(const MatrixRef& C, const MatrixRef& D, const Weight& Q,
                                    const Weight& R) {
  constexpr std::string_view where = "output_cost";
  FLYBALL_CHECK(Checks(where)
                    .shape(D, C.rows(), D.cols(), "D", "outputs x inputs")
                    .finite(C, "C")
                    .finite(D, "D"));
  FLYBALL_TRY(const auto weight_Q, detail::weight_of(Q, C.rows(), where, "Q", "outputs x outputs"));
  FLYBALL_TRY(const auto weight_R, detail::weight_of(R, D.cols(), where, "R", "inputs x inputs"));
  const Eigen::MatrixXd Q_C = detail::product(weight_Q, C);
  const Eigen::MatrixXd Q_D = detail::product(weight_Q, D);
  return QuadraticCost{detail::symmetrized(detail::transposed_product(C, Q_C)),
                       detail::symmetrized(detail::transposed_product(D, Q_D) + weight_R),
                       detail::transposed_product(C, Q_D)};
}

}  // namespace flyball
