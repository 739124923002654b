#include <flyball/systems/transmission_zeros.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "core/try.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/generalized.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/dense/pair_scaling.hpp"
#include "systems/balance.hpp"
#include "systems/timed.hpp"

namespace flyball {

namespace {

using detail::product;
using detail::transposed_product;
using Eigen::Index;
using Eigen::MatrixXd;

double power_of_two(double value) {
  return value > 0.0 && std::isfinite(value) ? std::exp2(std::round(std::log2(value))) : 1.0;
}

struct InUnits {
  ContinuousSystem<> system;
  int time = 0;  ///< Zeros of the given one are those of `system` times 2^time.
};

/// Whether entries are so far from one that their units decide.
bool has_units(const MatrixXd& M) {
  constexpr double far = 0x1p60;
  const auto size = M.array().abs();
  return (size > far || (size < 1.0 / far && size > 0.0)).any();
}

/// Far entries, brought near one by exponents alone.
InUnits in_ordinary_units(const ContinuousSystem<>& given) {
  const auto& [A, B, C, D] = given;
  if (!has_units(A) && !has_units(B) && !has_units(C) && !has_units(D)) {
    return {given};
  }
  // G(s) = 2^(-outputs - inputs - time) C'(s'I - A')⁻¹B' + D.
  detail::PairScaling units = detail::pair_scaling_of(A, B, C);
  const Eigen::VectorXi direct = (units.inputs.array() + units.time).matrix();
  // A direct way that is larger than those through the states.
  for (Index i = 0; i < D.rows(); ++i) {
    if (const Eigen::RowVectorXd row = D.row(i); !row.isZero(0.0)) {
      units.outputs(i) -=
          std::max(0, detail::largest_exponent(row, units.outputs.segment(i, 1), direct));
    }
  }
  return {{scaled_A(A, units), scaled_B(B, units), scaled_C(C, units),
           detail::times_powers(D, units.outputs, direct, 0)},
          units.time};
}

/// In units of states, inputs and outputs in which no row or column stands out. Zeros know none.
InUnits in_balanced_units(const ContinuousSystem<>& given) {
  auto [s, time] = in_ordinary_units(given);
  for (int sweep = 0; sweep < 8; ++sweep) {
    const double size = s.A.size() > 0 && !s.A.isZero(0.0) ? s.A.norm() : 1.0;
    for (Index j = 0; j < s.B.cols(); ++j) {
      const double f = power_of_two(std::hypot(s.B.col(j).norm(), s.D.col(j).norm()) / size);
      s.B.col(j) /= f;
      s.D.col(j) /= f;
    }
    for (Index i = 0; i < s.C.rows(); ++i) {
      const double f = power_of_two(std::hypot(s.C.row(i).norm(), s.D.row(i).norm()) / size);
      s.C.row(i) /= f;
      s.D.row(i) /= f;
    }
    const Eigen::VectorXd units = detail::scaling_of(s.A, s.B, s.C).states;
    s.A = units.cwiseInverse().asDiagonal() * s.A * units.asDiagonal();
    s.B = units.cwiseInverse().asDiagonal() * s.B;
    s.C = s.C * units.asDiagonal();
    if ((units.array() == 1.0).all() && sweep > 1) {
      break;
    }
  }
  return {std::move(s), time};
}

Index rank_of(const Eigen::VectorXd& values, double tolerance) {
  return (values.array() > tolerance).count();
}

/// The same zeros with fewer states, and D of full row rank.
ContinuousSystem<> reduced(ContinuousSystem<> s, double tolerance) {
  for (;;) {
    const Index n = s.A.rows();
    const Index p = s.D.rows();
    if (p == 0) {
      return s;
    }
    // Outputs that see u at once, above those that see states alone.
    Index rank = 0;
    MatrixXd C = s.C;
    MatrixXd D = s.D;
    if (s.D.cols() > 0) {
      const detail::SingularValues svd = detail::svd_of(s.D);
      rank = rank_of(svd.values, tolerance);
      C = transposed_product(svd.U, s.C);
      D = transposed_product(svd.U, s.D);
    }
    if (rank == p) {
      return s;
    }
    const MatrixXd C1 = C.topRows(rank);
    const MatrixXd D1 = D.topRows(rank);
    const MatrixXd C2 = C.bottomRows(p - rank);
    if (n == 0) {
      return {s.A, s.B, C1, D1};
    }
    const detail::SingularValues seen = detail::svd_of(C2);
    const Index fixed = rank_of(seen.values, tolerance);
    if (fixed == 0) {
      return {s.A, s.B, C1, D1};
    }
    // y₂ = 0 holds the first `fixed` states of V at zero; that their derivatives are is what the
    // others and u must see to.
    const MatrixXd& V = seen.V;
    const MatrixXd A = product(transposed_product(V, s.A), V);
    const MatrixXd B = transposed_product(V, s.B);
    const MatrixXd C1V = product(C1, V);
    const Index rest = n - fixed;
    ContinuousSystem<> next;
    next.A = A.bottomRightCorner(rest, rest);
    next.B = B.bottomRows(rest);
    next.C.resize(rank + fixed, rest);
    next.C << C1V.rightCols(rest), A.topRightCorner(fixed, rest);
    next.D.resize(rank + fixed, B.cols());
    next.D << D1, B.topRows(fixed);
    s = std::move(next);
  }
}

ContinuousSystem<> transposed(const ContinuousSystem<>& s) {
  return {s.A.transpose(), s.C.transpose(), s.B.transpose(), s.D.transpose()};
}

Expected<TransmissionZeros> zeros_of(const ContinuousSystem<>& given, double tolerance) {
  constexpr std::string_view where = "transmission_zeros";
  FLYBALL_CHECK(check_not_negative(tolerance, where, "tolerance"));
  if (tolerance >= 1.0) {
    return refusal(ArgumentError::out_of_range, where, "tolerance")
        .got(format_number(tolerance))
        .expected("below 1");
  }
  const auto [scaled, time] = in_balanced_units(given);
  const double size = std::sqrt(scaled.A.squaredNorm() + scaled.B.squaredNorm() +
                                scaled.C.squaredNorm() + scaled.D.squaredNorm());
  const double small =
      size * (tolerance > 0.0 ? tolerance
                              : 100.0 * std::numeric_limits<double>::epsilon() *
                                    static_cast<double>(std::max<Index>(1, given.A.rows())));
  // First what the outputs determine, then what the inputs do.
  const ContinuousSystem<> s = transposed(reduced(transposed(reduced(scaled, small)), small));
  TransmissionZeros found;
  found.normal_rank = s.D.rows();
  const Index n = s.A.rows();
  const Index r = s.D.rows();
  if (n == 0) {
    return found;
  }
  // [C D] W = [0 X]: the pencil [A B] W - s [I 0] W without the last columns.
  MatrixXd A = s.A;
  MatrixXd E = MatrixXd::Identity(n, n);
  if (r > 0) {
    MatrixXd CD(r, n + r);
    CD << s.C, s.D;
    const MatrixXd Q = detail::full_qr(CD.transpose()).Q;
    MatrixXd AB(n, n + r);
    AB << s.A, s.B;
    const MatrixXd W = Q.rightCols(n);
    A = product(AB, W);
    E = W.topRows(n);
    const auto pencil = detail::generalized_eigenvalues_of(A, E);
    if (!pencil) {
      return refusal(SystemError::no_convergence, where, "the zeros")
          .got("not found: the QZ iteration did not end");
    }
    found.zeros = pencil->alphas.cwiseQuotient(pencil->betas.cast<std::complex<double>>());
  } else {
    found.zeros = detail::eigenvalues_of(A);
  }
  found.zeros = detail::times_power(found.zeros, time);
  if (!found.zeros.allFinite()) {
    return refusal(SystemError::no_convergence, where, "the zeros")
        .got("not all finite")
        .hint("raise the tolerance: a singular value is neither zero nor not");
  }
  return found;
}

}  // namespace

Expected<TransmissionZeros> transmission_zeros(const ContinuousSystem<>& system, double tolerance) {
  FLYBALL_CHECK(check_system_or_gain(system, "transmission_zeros"));
  return zeros_of(system, tolerance);
}
Expected<TransmissionZeros> transmission_zeros(const DiscreteSystem<>& system, double tolerance) {
  FLYBALL_CHECK(check_system_or_gain(system, "transmission_zeros"));
  return zeros_of(detail::bare(system), tolerance);
}

}  // namespace flyball
