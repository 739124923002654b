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
Refusal uncontrollable_mode(const Eigen::VectorXcd& y, const Eigen::VectorXd& units, Complex mode) {
  Eigen::VectorXd share = y.cwiseAbs().cwiseQuotient(units);
  share /= share.maxCoeff();
  std::string states;
  for (Eigen::Index i = 0; i < share.size(); ++i) {
    if (share(i) > 0.1) {
      states += detail::format("{}{}", states.empty() ? "" : ", ", i);
    }
  }
  return refusal(PolePlacementError::not_controllable, {}, "(A, B)")
      .hint("keep this mode among the poles, or give it an input")
      .with("mode", {mode.real(), mode.imag()})
      .with("states it lives in (counted from 0)", states);
}

/// How far a pole may be from a mode that stays: the mode itself is known to rounding times its
/// sensitivity, 1/`along`.
double kept_within(Complex mode, double along) {
  return std::min(1e-4, 1e-8 / std::max(along, 1e-16)) * std::max(1.0, std::abs(mode));
}

}  // namespace

Expected<Eigen::VectorXcd> poles_to_move(const ControllableStaircase& form,
                                         const Eigen::VectorXd& units,
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
  const std::vector<std::size_t> order = matched(right.values, wanted);
  std::vector<bool> stays(static_cast<std::size_t>(n), false);
  for (Eigen::Index i = 0; i < rest; ++i) {
    const Complex mode = right.values(i);
    const std::size_t match = order[static_cast<std::size_t>(i)];
    Eigen::Index same = 0;
    (left.values.array() - mode).abs().minCoeff(&same);
    const double along =
        std::abs((left.vectors.col(same).transpose() * right.vectors.col(i)).value());
    if (!(std::abs(wanted(static_cast<Eigen::Index>(match)) - mode) <= kept_within(mode, along))) {
      return uncontrollable_mode(form.Q.rightCols(rest).cast<Complex>() * left.vectors.col(same),
                                 units, mode);
    }
    stays[match] = true;
    staying.push_back(mode);
  }
  Eigen::VectorXcd moved(form.controllable);
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!stays[static_cast<std::size_t>(i)]) {
      moved(count++) = wanted(i);
    }
  }
  return moved;
}

Error weakest_mode(const MatrixRef& A, const MatrixRef& B, const Eigen::VectorXd& units,
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
