#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <flyball/control/pole_placement.hpp>

#include "control/placement.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;

/// The answer to poles that leave out a mode yᴴx on which no input acts, yᴴ A = λ yᴴ, yᴴ B = 0.
Refusal uncontrollable_mode(const Eigen::VectorXcd& y, const GivenUnits& units, Complex mode) {
  Eigen::VectorXd share = y.cwiseAbs().cwiseQuotient(units.states);
  share /= share.maxCoeff();
  std::string states;
  for (Eigen::Index i = 0; i < share.size(); ++i) {
    if (share(i) > 0.1) {
      states += detail::format("{}{}", states.empty() ? "" : ", ", i);
    }
  }
  return refusal(PolePlacementError::not_controllable, {}, "(A, B)")
      .hint("keep this mode among the poles, or give it an input")
      .with("mode", {std::ldexp(mode.real(), units.time), std::ldexp(mode.imag(), units.time)})
      .with("states it lives in (counted from 0)", states);
}

/// How far a pole may be from a mode that stays: the mode itself is known to rounding times its
/// sensitivity, 1/`along`.
double kept_within(Complex mode, double along) {
  return std::min(1e-4, 1e-8 / std::max(along, 1e-16)) * std::max(1.0, std::abs(mode));
}

}  // namespace

Expected<Eigen::VectorXcd> poles_to_move(const ControllableStaircase& form, const GivenUnits& units,
                                         const Eigen::VectorXcd& wanted,
                                         std::vector<Complex>& staying) {
  const Eigen::Index n = form.A.rows();
  const Eigen::Index rest = n - form.controllable;
  if (rest == 0) {
    return wanted;
  }
  const Eigen::MatrixXd A_u = form.A.bottomRightCorner(rest, rest);
  const Eigensystem right = eigensystem_of(A_u);
  const Eigensystem left = eigensystem_of(A_u.transpose());
  const std::vector<std::size_t> left_of = matched(right.values, left.values);
  const auto vector_of = [&](Eigen::Index i) {
    return left.vectors.col(static_cast<Eigen::Index>(left_of[static_cast<std::size_t>(i)]));
  };
  const auto error_of = [&](Eigen::Index i) {
    return uncontrollable_mode(form.Q.rightCols(rest).cast<Complex>() * vector_of(i), units,
                               right.values(i));
  };
  // A real mode takes a real pole, one of a pair one of a pair: else what is left has no gain. Two
  // modes may take both of a pair that is as near to them as rounding.
  constexpr Eigen::Index nothing = -1;
  std::vector<Eigen::Index> taken_by(static_cast<std::size_t>(n), nothing);
  for (Eigen::Index i = 0; i < rest; ++i) {
    const Complex mode = right.values(i);
    const double along = std::abs((vector_of(i).transpose() * right.vectors.col(i)).value());
    const double within = kept_within(mode, along);
    Eigen::Index best = nothing;
    double least = infinite;
    for (Eigen::Index j = 0; j < n; ++j) {
      const double distance = std::abs(wanted(j) - mode);
      const bool other_kind = (wanted(j).imag() == 0.0) != (mode.imag() == 0.0);
      const double cost = distance + (other_kind ? 2.0 * within : 0.0);
      if (taken_by[static_cast<std::size_t>(j)] == nothing && distance <= within && cost < least) {
        best = j;
        least = cost;
      }
    }
    if (best == nothing) {
      return error_of(i);
    }
    taken_by[static_cast<std::size_t>(best)] = i;
    staying.emplace_back(std::ldexp(mode.real(), units.time), std::ldexp(mode.imag(), units.time));
  }
  Eigen::VectorXcd moved(form.controllable);
  Eigen::Index count = 0;
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Index by = taken_by[static_cast<std::size_t>(j)];
    if (wanted(j).imag() != 0.0) {
      const Eigen::Index other = taken_by[static_cast<std::size_t>(j + 1)];
      if ((by == nothing) != (other == nothing)) {
        return error_of(std::max(by, other));
      }
      if (by == nothing) {
        moved.segment(count, 2) = wanted.segment(j, 2);
        count += 2;
      }
      ++j;
    } else if (by == nothing) {
      moved(count++) = wanted(j);
    }
  }
  return moved;
}

Error weakest_mode(const MatrixRef& A, const MatrixRef& B, const GivenUnits& units,
                   const Eigen::VectorXcd& wanted) {
  const Eigen::Index n = A.rows();
  Eigen::MatrixXd B_unit = B;
  for (Eigen::Index j = 0; j < B.cols(); ++j) {
    const double length = B.col(j).norm();
    B_unit.col(j) *= length > 0.0 ? A.norm() / length : 0.0;
  }
  const Eigensystem left = eigensystem_of(A.transpose());
  Eigen::Index weakest = 0;
  double smallest = infinite;
  for (Eigen::Index i = 0; i < n; ++i) {
    // Popov, Belevitch and Hautus: rank [A - λ, B] < n for a mode that no input reaches.
    const Complex mode = left.values(i);
    Eigen::MatrixXcd pencil(n, n + B.cols());
    pencil << A.cast<Complex>(), B_unit.cast<Complex>();
    pencil.diagonal().array() -= mode;
    const double reach = singular_values_of_complex(pencil)(n - 1);
    if (reach < smallest && (wanted.array() - mode).abs().minCoeff() > kept_within(mode, 1.0)) {
      smallest = reach;
      weakest = i;
    }
  }
  return uncontrollable_mode(left.vectors.col(weakest), units, left.values(weakest));
}

}  // namespace flyball::detail
