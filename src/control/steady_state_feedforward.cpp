#include <flyball/control/steady_state_feedforward.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/extended/double_double.hpp"

namespace flyball {

namespace {

constexpr std::string_view where = "steady_state_feedforward";

/// N_x and N_u for one set of inputs and outputs.
Expected<SteadyStateFeedforward<>> solve(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                         const MatrixRef& D, Eigen::Index first_output) {
  constexpr double left_over = 1e-9;
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const Eigen::Index p = C.rows();
  Eigen::MatrixXd balance(n + p, n + m);
  balance << A, B, C, D;
  Eigen::MatrixXd target = Eigen::MatrixXd::Zero(n + p, p);
  target.bottomRows(p).setIdentity();
  // Columns of a size that would hide the others: their unknowns in other units.
  Eigen::VectorXi units(n + m);
  Eigen::MatrixXd scaled = balance;
  for (Eigen::Index j = 0; j < n + m; ++j) {
    units(j) = detail::unit_of(balance.col(j));
    scaled.col(j) = detail::times_power(balance.col(j), -units(j));
  }
  Eigen::MatrixXd N = detail::solve_least_squares(scaled, target);
  for (Eigen::Index j = 0; j < n + m; ++j) {
    N.row(j) = detail::times_power(N.row(j), -units(j));
  }
  const Eigen::MatrixXd rest = detail::product(balance, N) - target;
  const Eigen::MatrixXd terms = balance.cwiseAbs() * N.cwiseAbs();
  for (Eigen::Index j = 0; j < p; ++j) {
    // Row by row, because the rows have different units.
    for (Eigen::Index i = 0; i < n + p; ++i) {
      const double size = std::max(terms(i, j), target(i, j));
      if (!(std::abs(rest(i, j)) <= left_over * size) && size > 0.0) {
        return refusal(FeedforwardError::no_steady_state, where,
                       detail::format("output {}", first_output + j))
            .hint("hold another output, or give the plant an input that can")
            .with("what is left of its equation", rest.col(j).norm());
      }
    }
  }
  SteadyStateFeedforward<> feedforward{N.topRows(n), N.bottomRows(m), {}};
  feedforward.K_ff = detail::product(
      feedforward.N_u,
      detail::solve_least_squares(feedforward.N_x, Eigen::MatrixXd::Identity(n, n)));
  return feedforward;
}

/// Powers of two: states and inputs in units in which no entry of Q, R, and B where Q weighs it, is
/// above one.
struct InversionUnits {
  Eigen::VectorXi states;
  Eigen::VectorXi inputs;
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> weighted;  ///< Entries of B.
};

InversionUnits inversion_units(const MatrixRef& B, const MatrixRef& Q, const MatrixRef& R) {
  constexpr int none = -5000;
  const auto above = [](double x) { return x == 0.0 ? none : std::ilogb(x) + 1; };
  const Eigen::Index n = B.rows();
  const Eigen::Index m = B.cols();
  InversionUnits units{Eigen::VectorXi::Zero(n), Eigen::VectorXi::Zero(m),
                       Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(n, m, false)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const int weight = above(Q.row(i).cwiseAbs().maxCoeff());
    units.weighted.row(i) = weight > none;
    units.states(i) = weight > none ? -(weight / 2 + 1) : 0;
  }
  for (Eigen::Index j = 0; j < m; ++j) {
    const int weight = above(R.row(j).cwiseAbs().maxCoeff());
    int size = weight > none ? weight / 2 + 1 : none;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (units.weighted(i, j) && B(i, j) != 0.0) {
        size = std::max(size, above(B(i, j)) - units.states(i));
      }
    }
    units.inputs(j) = size > none ? -size : 0;
  }
  return units;
}

}  // namespace

ErrorInfo error_info(FeedforwardError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_steady_state", "no constant input holds the output at every value",
       ErrorKind::no_answer},
      {"singular", "B'QB + R is not positive definite", ErrorKind::no_answer},
      {"overflow", "the gain exceeds the largest double", ErrorKind::no_answer},
  };
  return detail::info_of(code, "feedforward", rows);
}

Expected<SteadyStateFeedforward<>> steady_state_feedforward(const MatrixRef& A, const MatrixRef& B,
                                                            const MatrixRef& C,
                                                            const MatrixRef& D) {
  return check_system(A, B, C, D, where).and_then([&] { return solve(A, B, C, D, 0); });
}

Expected<SteadyStateFeedforward<>> steady_state_feedforward_of_pairs(const MatrixRef& A,
                                                                     const MatrixRef& B,
                                                                     const MatrixRef& C,
                                                                     const MatrixRef& D,
                                                                     std::span<const int> inputs) {
  FLYBALL_CHECK(check_system(A, B, C, D, where));
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const Eigen::Index p = C.rows();
  if (static_cast<Eigen::Index>(inputs.size()) != p) {
    return refusal(ArgumentError::wrong_shape, where, "inputs")
        .got(detail::format("{} entries", inputs.size()))
        .expected(detail::format("one an output ({})", p));
  }
  SteadyStateFeedforward<> sum{Eigen::MatrixXd::Zero(n, p), Eigen::MatrixXd::Zero(m, p),
                               Eigen::MatrixXd::Zero(m, n)};
  for (Eigen::Index j = 0; j < p; ++j) {
    const int input = inputs[static_cast<std::size_t>(j)];
    if (input < 0 || input >= m) {
      return refusal(ArgumentError::out_of_range, where,
                     detail::format("the input of output {}", j))
          .got(detail::format("{}", input))
          .expected(detail::format("from 0 to {}", m - 1));
    }
    FLYBALL_TRY(const auto pair, solve(A, B.col(input), C.row(j), D.block(j, input, 1, 1), j));
    sum.N_x.col(j) = pair.N_x;
    sum.N_u(input, j) += pair.N_u(0, 0);
    sum.K_ff.row(input) += pair.K_ff;
  }
  return sum;
}

Expected<Eigen::MatrixXd> qr_weighted_gain(const MatrixRef& B, const Weight& Q, const Weight& R) {
  constexpr std::string_view name = "qr_weighted_gain";
  if (!Q.get() || !R.get()) {
    return tl::unexpected((Q.get() ? R : Q).get().error());
  }
  const Eigen::MatrixXd& weight_Q = *Q.get();
  const Eigen::MatrixXd& weight_R = *R.get();
  const Eigen::Index n = B.rows();
  const Eigen::Index m = B.cols();
  FLYBALL_CHECK(Checks(name)
                    .shape(weight_Q, n, n, "Q", "states x states")
                    .shape(weight_R, m, m, "R", "inputs x inputs")
                    .finite(B, "B")
                    .finite(weight_Q, "Q")
                    .finite(weight_R, "R")
                    .symmetric(weight_Q, "Q")
                    .symmetric(weight_R, "R"));
  const InversionUnits units = inversion_units(B, weight_Q, weight_R);
  const Eigen::VectorXi& x = units.states;
  const Eigen::VectorXi& u = units.inputs;
  const detail::DoubleDoubleMatrix Q_scaled(detail::times_powers(weight_Q, x, x, 0));
  // What has no weight may be of any size.
  const auto scaled_B = [&](int lift) {
    return detail::DoubleDoubleMatrix(
        units.weighted.select(detail::times_powers(B, -x, u, lift), 0.0));
  };
  const detail::DoubleDoubleMatrix B_scaled = scaled_B(0);
  const detail::DoubleDoubleMatrix inner =
      symmetrized(add_product(detail::DoubleDoubleMatrix(detail::times_powers(weight_R, u, u, 0)),
                              1.0, product(B_scaled.transpose(), Q_scaled), B_scaled));
  // Beside a large R, BᵀQ may be so small that its products need another unit.
  const double largest = B.size() > 0 ? B_scaled.hi.cwiseAbs().maxCoeff() : 0.0;
  const int lift = largest > 0.0 ? -std::ilogb(largest) : 0;
  const auto gain = m > 0 && detail::cholesky_of(inner.rounded())
                        ? solve(inner, product(scaled_B(lift).transpose(), Q_scaled))
                        : std::nullopt;
  if (!gain || !gain->all_finite()) {
    return refusal(FeedforwardError::singular, name, "B'QB + R")
        .hint("give every input a weight in R");
  }
  Eigen::MatrixXd K = detail::times_powers(gain->rounded(), u, -x, -lift);
  if (!K.allFinite()) {
    return refusal(FeedforwardError::overflow, name, "K_ff")
        .hint("choose units in which the entries of B are nearer to 1");
  }
  return K;
}

}  // namespace flyball
