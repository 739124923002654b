#include <flyball/math/regression/bounded_least_squares.hpp>

#include <cmath>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/regression/decomposition.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::string_view in_bounded_least_squares = "bounded_least_squares";

Expected<VectorXd> bounds_of(const VectorXd& given, Index p, std::string_view name) {
  VectorXd bounds = given.size() == 1 ? VectorXd::Constant(p, given(0)) : given;
  if (bounds.size() != p) {
    return refusal(ArgumentError::wrong_shape, in_bounded_least_squares, name)
        .got(detail::format("of {}", given.size()))
        .expected(detail::format("of {}, one a coefficient, or of 1", p));
  }
  if (bounds.array().isNaN().any()) {
    return refusal(ArgumentError::not_finite, in_bounded_least_squares, name)
        .got("NaN")
        .expected("numbers");
  }
  return bounds;
}

/// ‖R β - c‖ with R and c as small as p allows, the columns of R near length 1.
class ActiveSet {
 public:
  ActiveSet(MatrixXd R, VectorXd c, VectorXd lower, VectorXd upper)
      : R_(std::move(R)),
        c_(std::move(c)),
        lower_(std::move(lower)),
        upper_(std::move(upper)),
        state_(static_cast<std::size_t>(R_.cols()), BoundState::at_lower),
        x_(VectorXd::Zero(R_.cols())) {
    for (Index j = 0; j < R_.cols(); ++j) {
      if (std::isinf(lower_(j))) {
        state_of(j) = std::isinf(upper_(j)) ? BoundState::between : BoundState::at_upper;
      }
      keep(j);
    }
  }

  /// @return  Whether the optimum was reached.
  bool solve(int most) {
    if (!improve(most)) {
      return false;
    }
    std::vector<bool> refused(state_.size(), false);
    while (iterations_ < most) {
      const VectorXd gradient = R_.transpose() * (R_ * x_ - c_);
      const double rounding = 1e-14 * (c_.norm() + (R_ * x_).norm());
      Index best = -1;
      for (Index j = 0; j < x_.size(); ++j) {
        const bool wants = (state_of(j) == BoundState::at_lower && gradient(j) < -rounding) ||
                           (state_of(j) == BoundState::at_upper && gradient(j) > rounding);
        if (wants && lower_(j) < upper_(j) && !refused[static_cast<std::size_t>(j)] &&
            (best < 0 || std::abs(gradient(j)) > std::abs(gradient(best)))) {
          best = j;
        }
      }
      if (best < 0) {
        return true;
      }
      const BoundState before = state_of(best);
      state_of(best) = BoundState::between;
      ++iterations_;
      // By rounding alone a freed coefficient may want to go back at once.
      const double target = free_optimum()(best);
      if (before == BoundState::at_lower ? target <= lower_(best) : target >= upper_(best)) {
        state_of(best) = before;
        refused[static_cast<std::size_t>(best)] = true;
        continue;
      }
      refused.assign(state_.size(), false);
      if (!improve(most)) {
        return false;
      }
    }
    return false;
  }

  [[nodiscard]] const VectorXd& x() const { return x_; }
  [[nodiscard]] const std::vector<BoundState>& state() const { return state_; }
  [[nodiscard]] int iterations() const { return iterations_; }

 private:
  BoundState& state_of(Index j) { return state_[static_cast<std::size_t>(j)]; }

  /// A coefficient at a bound is the bound.
  void keep(Index j) {
    if (state_of(j) == BoundState::at_lower) {
      x_(j) = lower_(j);
    } else if (state_of(j) == BoundState::at_upper) {
      x_(j) = upper_(j);
    }
  }

  /// The best x with those at bounds where they are.
  [[nodiscard]] VectorXd free_optimum() {
    std::vector<Index> free;
    VectorXd optimum = x_;
    for (Index j = 0; j < x_.size(); ++j) {
      if (state_of(j) == BoundState::between) {
        free.push_back(j);
        optimum(j) = 0.0;
      }
    }
    if (!free.empty()) {
      optimum(free) = detail::solve_least_squares(R_(Eigen::all, free), c_ - R_ * optimum);
    }
    return optimum;
  }

  /// Goes to the best x of the free ones; each bound that stands in the way is taken.
  bool improve(int most) {
    while (iterations_ <= most) {
      const VectorXd target = free_optimum();
      double step = 1.0;
      Index first = -1;
      for (Index j = 0; j < x_.size(); ++j) {
        if (state_of(j) != BoundState::between) {
          continue;
        }
        const double limit = target(j) < lower_(j)   ? lower_(j)
                             : target(j) > upper_(j) ? upper_(j)
                                                     : target(j);
        if (limit != target(j)) {
          const double share =
              target(j) == x_(j) ? 0.0 : std::max(0.0, (limit - x_(j)) / (target(j) - x_(j)));
          if (first < 0 || share < step) {
            step = std::min(share, 1.0);
            first = j;
          }
        }
      }
      if (first < 0) {
        x_ = target;
        return true;
      }
      for (Index j = 0; j < x_.size(); ++j) {
        if (state_of(j) == BoundState::between) {
          x_(j) += step * (target(j) - x_(j));
        }
      }
      state_of(first) = target(first) < lower_(first) ? BoundState::at_lower : BoundState::at_upper;
      keep(first);
      ++iterations_;
    }
    return false;
  }

  MatrixXd R_;
  VectorXd c_;
  VectorXd lower_;
  VectorXd upper_;
  std::vector<BoundState> state_;
  VectorXd x_;
  int iterations_ = 0;
};

}  // namespace

Expected<BoundedLeastSquares> bounded_least_squares(const MatrixRef& X, const MatrixRef& y,
                                                    const VectorXd& lower, const VectorXd& upper) {
  FLYBALL_CHECK(Checks(in_bounded_least_squares)
                    .finite(X, "X")
                    .shape(y, X.rows(), 1, "y", "rows of X")
                    .finite(y, "y"));
  const Index p = X.cols();
  if (X.size() == 0) {
    return refusal(ArgumentError::empty, in_bounded_least_squares, "X")
        .expected("rows x coefficients");
  }
  FLYBALL_TRY(const VectorXd low, bounds_of(lower, p, "lower"));
  FLYBALL_TRY(const VectorXd high, bounds_of(upper, p, "upper"));
  for (Index j = 0; j < p; ++j) {
    if (!(low(j) <= high(j)) || low(j) == infinity || high(j) == -infinity) {
      return refusal(ArgumentError::out_of_range, in_bounded_least_squares,
                     detail::format("the bounds of coefficient {}", j))
          .got(detail::format("from {} to {}", low(j), high(j)))
          .expected("increasing, with a number between them");
    }
  }
  const VectorXd units = detail::column_units(X);
  MatrixXd both(X.rows(), p + 1);
  both << X * units.asDiagonal(), y;
  const MatrixXd R = detail::triangle_of(both);
  ActiveSet search(R.leftCols(p), R.col(p), low.cwiseQuotient(units), high.cwiseQuotient(units));
  const int most = 30 * static_cast<int>(p) + 100;
  if (!search.solve(most)) {
    return refusal(RegressionError::no_convergence, in_bounded_least_squares)
        .hint("leave out columns that depend on each other")
        .with("changes", static_cast<double>(search.iterations()));
  }
  BoundedLeastSquares fit;
  fit.coefficients = units.cwiseProduct(search.x());
  fit.state = search.state();
  for (Index j = 0; j < p; ++j) {
    const BoundState state = fit.state[static_cast<std::size_t>(j)];
    fit.coefficients(j) = state == BoundState::at_lower   ? low(j)
                          : state == BoundState::at_upper ? high(j)
                                                          : fit.coefficients(j);
  }
  const VectorXd residual = X * fit.coefficients - y;
  fit.gradient = X.transpose() * residual;
  fit.residual_norm = residual.norm();
  fit.iterations = search.iterations();
  return fit;
}

}  // namespace flyball
