#include <flyball/control/steady_state_feedforward.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/extended/wide_matrix.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_steady_state_feedforward = "steady_state_feedforward";

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
        return refusal(FeedforwardError::no_steady_state, in_steady_state_feedforward,
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
  return check_system(A, B, C, D, in_steady_state_feedforward).and_then([&] {
    return solve(A, B, C, D, 0);
  });
}

Expected<SteadyStateFeedforward<>> steady_state_feedforward_of_pairs(const MatrixRef& A,
                                                                     const MatrixRef& B,
                                                                     const MatrixRef& C,
                                                                     const MatrixRef& D,
                                                                     std::span<const int> inputs) {
  FLYBALL_CHECK(check_system(A, B, C, D, in_steady_state_feedforward));
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const Eigen::Index p = C.rows();
  if (static_cast<Eigen::Index>(inputs.size()) != p) {
    return refusal(ArgumentError::wrong_shape, in_steady_state_feedforward, "inputs")
        .got(detail::format("{} entries", inputs.size()))
        .expected(detail::format("one an output ({})", p));
  }
  SteadyStateFeedforward<> sum{Eigen::MatrixXd::Zero(n, p), Eigen::MatrixXd::Zero(m, p),
                               Eigen::MatrixXd::Zero(m, n)};
  for (Eigen::Index j = 0; j < p; ++j) {
    const int input = inputs[static_cast<std::size_t>(j)];
    if (input < 0 || input >= m) {
      return refusal(ArgumentError::out_of_range, in_steady_state_feedforward,
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
  using detail::WideMatrix;
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
  const WideMatrix B_wide(B);
  const WideMatrix BQ = product(B_wide.transpose(), symmetrized(WideMatrix(weight_Q)));
  const WideMatrix inner = symmetrized(add_product(WideMatrix(weight_R), 1.0, BQ, B_wide));
  // The inputs in units in which the diagonal is near one.
  Eigen::VectorXi unit(m);
  for (Eigen::Index j = 0; j < m; ++j) {
    unit(j) = static_cast<int>(-inner(j, j).exponent / 2);
  }
  const Eigen::VectorXi none = Eigen::VectorXi::Zero(n);
  const WideMatrix scaled = inner.times_powers(unit, unit, 0);
  const auto gain = m > 0 && detail::cholesky_of(scaled.rounded())
                        ? solve(scaled, BQ.times_powers(unit, none, 0))
                        : std::nullopt;
  if (!gain || !gain->all_finite()) {
    return refusal(FeedforwardError::singular, name, "B'QB + R")
        .hint("give every input a weight in R");
  }
  const Eigen::MatrixXd K = gain->times_powers(unit, none, 0).rounded();
  if (!K.allFinite()) {
    return refusal(FeedforwardError::overflow, name, "K_ff")
        .hint("choose units in which the entries of B are nearer to 1");
  }
  constexpr double largest = 1e-10;
  const WideMatrix K_wide(K);
  const double residual =
      share_of(sum(product(inner, K_wide), -1.0, BQ),
               sum(product(inner.magnitudes(), K_wide.magnitudes()), 1.0, BQ.magnitudes()));
  if (!(residual <= largest)) {
    return refusal(FeedforwardError::singular, name, "B'QB + R")
        .got("singular but for rounding")
        .hint("give every input a weight in R")
        .with("residual", residual);
  }
  return K;
}

}  // namespace flyball
