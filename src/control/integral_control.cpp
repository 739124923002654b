#include <flyball/control/integral_control.hpp>

#include <string>

#include "control/weights.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

/// Whether a constant input holds the outputs anywhere: [A - e I  B; C  D] has independent rows.
Expected<void> check_trackable(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                               const MatrixRef& D, double e, std::string_view where) {
  const Eigen::Index n = A.rows();
  const Eigen::Index p = C.rows();
  Eigen::MatrixXd balance(n + p, n + B.cols());
  balance << A, B, C, D;
  balance.topLeftCorner(n, n).diagonal().array() -= e;
  // Rows and columns of one size, so that units do not decide.
  for (int pass = 0; pass < 3; ++pass) {
    for (Eigen::Index i = 0; i < balance.rows(); ++i) {
      const double size = balance.row(i).norm();
      balance.row(i) /= size > 0.0 ? size : 1.0;
    }
    for (Eigen::Index j = 0; j < balance.cols(); ++j) {
      const double size = balance.col(j).norm();
      balance.col(j) /= size > 0.0 ? size : 1.0;
    }
  }
  const Eigen::VectorXd singular = detail::singular_values_of(balance);
  const double smallest = p > B.cols() ? 0.0 : singular(n + p - 1);
  if (smallest > 1e-12 * singular(0)) {
    return {};
  }
  return refusal(IntegralControlError::not_trackable, where, "the plant")
      .hint(
          "track fewer outputs, or others: each needs an input of its own that moves it in steady "
          "state")
      .with("outputs", static_cast<double>(p))
      .with("inputs", static_cast<double>(B.cols()))
      .with(std::string("smallest singular value of ") +
                (e == 0.0 ? "[A, B; C, D]" : "[A - I, B; C, D]") + ", rows and columns scaled",
            smallest);
}

}  // namespace

namespace detail {

Expected<IntegralPlant> integral_plant(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                       const MatrixRef& D, double h, double e, const Weight& Q,
                                       std::string_view where) {
  const Eigen::Index n = A.rows();
  const Eigen::Index p = C.rows();
  if (Q.get()) {
    FLYBALL_CHECK(
        check_shape(*Q.get(), n + p, n + p, where, "Q", "(states + outputs) x (states + outputs)"));
  }
  FLYBALL_CHECK(check_trackable(A, B, C, D, e, where));
  IntegralPlant plant{Eigen::MatrixXd::Zero(n + p, n + p), Eigen::MatrixXd::Zero(n + p, B.cols())};
  plant.A.topLeftCorner(n, n) = A;
  plant.A.bottomLeftCorner(p, n) = -h * C;
  plant.A.bottomRightCorner(p, p).diagonal().setConstant(e);
  plant.B.topRows(n) = B;
  plant.B.bottomRows(p) = -h * D;
  return plant;
}

Expected<IntegralLqr> split_integral(Expected<LqrDesign<>>&& design, Eigen::Index n,
                                     std::string_view where) {
  if (!design) {
    const bool weight = design.error().where() == "bryson";
    return tl::unexpected(weight ? design.error()
                                 : Error(std::move(design.error()).in(std::string(where))));
  }
  return IntegralLqr{design->K.leftCols(n), design->K.rightCols(design->K.cols() - n),
                     std::move(design->S),  std::move(design->poles),
                     design->residual,      design->condition};
}

}  // namespace detail

ErrorInfo error_info(IntegralControlError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_trackable", "no constant input holds the outputs at every value", ErrorKind::no_answer},
      {"not_matched", "no combination of inputs acts like the disturbance", ErrorKind::no_answer},
  };
  return detail::info_of(code, "integral_control", rows);
}

Expected<IntegralLqr> lqi(const DiscreteSystem<>& plant, const Weight& Q, const Weight& R) {
  FLYBALL_CHECK(check_system(plant, "lqi"));
  return detail::integral_plant(plant.A, plant.B, plant.C, plant.D, plant.period.si(), 1.0, Q,
                                "lqi")
      .and_then([&](const detail::IntegralPlant& augmented) {
        return detail::split_integral(lqr(augmented.A, augmented.B, Q, R), plant.A.rows(), "lqi");
      });
}

Expected<Eigen::MatrixXd> input_error_gain(const MatrixRef& B, const MatrixRef& B_error) {
  constexpr std::string_view where = "input_error_gain";
  constexpr double negligible = 1e-9;
  if (B.size() == 0) {
    return refusal(ArgumentError::empty, where, "B").got("empty").expected("states x inputs");
  }
  FLYBALL_CHECK(Checks(where)
                    .shape(B_error, B.rows(), B_error.cols(), "B_error", "states x disturbances")
                    .finite(B, "B")
                    .finite(B_error, "B_error"));
  Eigen::MatrixXd gain = detail::solve_least_squares(B, B_error);
  const double left = (detail::product(B, gain) - B_error).norm();
  if (left > negligible * B_error.norm()) {
    return refusal(IntegralControlError::not_matched, where, "B_error")
        .hint("estimate a disturbance that enters where an input does")
        .with("share that no input cancels", left / B_error.norm());
  }
  return gain;
}

}  // namespace flyball
