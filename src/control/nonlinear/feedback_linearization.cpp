#include <flyball/control/nonlinear/feedback_linearization.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::detail {

Expected<void> check_feedback_linearization(const MatrixRef& f, const MatrixRef& B,
                                            const MatrixRef& f_at_u, const MatrixRef& u,
                                            const MatrixRef& error_gain, const MatrixRef& u_min,
                                            const MatrixRef& u_max) {
  constexpr std::string_view where = "FeedbackLinearization";
  FLYBALL_CHECK(check_finite(error_gain, where, "error_gain"));
  for (Eigen::Index i = 0; i < u_min.size(); ++i) {
    if (!(u_min(i, 0) < u_max(i, 0))) {
      return refusal(ArgumentError::out_of_range, where, detail::format("u_min of input {}", i + 1))
          .got(format_number(u_min(i, 0)))
          .expected(detail::format("below u_max, {}", format_number(u_max(i, 0))));
    }
  }
  FLYBALL_CHECK(check_finite(B, where, "the Jacobian of the inputs"));
  const Eigen::VectorXd linear = f + B * u;
  const double scale = f.norm() + (B.cwiseAbs() * u.cwiseAbs()).norm();
  if ((f_at_u - linear).norm() > 1e-9 * scale) {
    return refusal(ArgumentError::out_of_range, where, "the model")
        .got("not affine in its input")
        .expected("dx/dt = f(x) + B(x) u")
        .hint("take the input that enters linearly, such as a force in place of a throttle")
        .with("input", std::vector<double>(u.data(), u.data() + u.size()))
        .with("share that is not linear", (f_at_u - linear).norm() / scale);
  }
  for (Eigen::Index j = 0; j < B.cols(); ++j) {
    if (!(B.col(j).norm() > 0.0)) {
      return refusal(ArgumentError::out_of_range, where, detail::format("input {}", j + 1))
          .got("without effect at x")
          .expected("one that moves a state");
    }
  }
  return {};
}

}  // namespace flyball::detail
