#include <flyball/control/quadratic_cost.hpp>

#include <string>

#include "control/weights.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace detail {

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

}  // namespace detail

Expected<QuadraticCost> output_cost(const MatrixRef& C, const MatrixRef& D, const Weight& Q,
                                    const Weight& R) {
  constexpr std::string_view where = "output_cost";
  if (auto checked = check_all(check_shape(D, C.rows(), D.cols(), where, "D", "outputs x inputs"),
                               check_finite(C, where, "C"), check_finite(D, where, "D"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  const auto weight_Q = detail::weight_of(Q, C.rows(), where, "Q", "outputs x outputs");
  if (!weight_Q) {
    return tl::unexpected(weight_Q.error());
  }
  const auto weight_R = detail::weight_of(R, D.cols(), where, "R", "inputs x inputs");
  if (!weight_R) {
    return tl::unexpected(weight_R.error());
  }
  const Eigen::MatrixXd Q_C = detail::product(*weight_Q, C);
  const Eigen::MatrixXd Q_D = detail::product(*weight_Q, D);
  return QuadraticCost{detail::symmetrized(detail::transposed_product(C, Q_C)),
                       detail::symmetrized(detail::transposed_product(D, Q_D) + *weight_R),
                       detail::transposed_product(C, Q_D)};
}

}  // namespace flyball
