#include <cmath>
#include <complex>
#include <string>

#include <flyball/systems/controllability.hpp>

#include "control/robust/synthesis.hpp"
#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/pair_scaling.hpp"
#include "systems/algebraic_loop.hpp"

namespace flyball {

ErrorInfo error_info(SynthesisError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_stabilizable", "no control moves a mode that does not decay", ErrorKind::no_answer},
      {"not_detectable", "no measurement shows a mode that does not decay", ErrorKind::no_answer},
      {"control_without_weight", "a control costs nothing at high frequencies",
       ErrorKind::no_answer},
      {"measurement_without_noise", "a measurement is exact at high frequencies",
       ErrorKind::no_answer},
      {"control_zero_on_axis", "from controls to errors there is a zero on the border of stability",
       ErrorKind::no_answer},
      {"measurement_zero_on_axis",
       "from disturbances to measurements there is a zero on the border of stability",
       ErrorKind::no_answer},
      {"level_not_reached", "no controller reaches the level", ErrorKind::no_answer},
      {"direct_disturbance", "a disturbance passes straight to the errors", ErrorKind::no_answer},
      {"not_verified", "no controller was found that does what it should", ErrorKind::no_answer},
  };
  return detail::info_of(code, "synthesis", rows);
}

namespace detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

/// s = (z - 1)/(z + 1), back.
Complex told(Complex s, bool discrete) {
  return discrete ? (1.0 + s) / (1.0 - s) : s;
}

template <class Analysis>
Expected<void> check_modes(const Analysis& analysis, bool fine, bool discrete, SynthesisError code,
                           std::string_view where, std::string_view subject,
                           std::string_view hint) {
  if (fine) {
    return {};
  }
  for (const ModeReach& mode : analysis.modes) {
    if (!mode.reached && mode.stability != Stability::stable) {
      const Complex at = told(mode.eigenvalue, discrete);
      return refusal(code, where, subject)
          .hint(std::string(hint))
          .with("mode", {at.real(), at.imag()});
    }
  }
  return {};
}

/// A zero jω at which [A - jωI; C] loses rank: the modes of A that C does not see.
std::optional<Complex> axis_mode(const MatrixXd& A, const MatrixXd& C) {
  const Index n = A.rows();
  const PairScaling units = pair_scaling_of(A.transpose(), C.transpose());
  const MatrixXd F = scaled_A(A.transpose(), units).transpose();
  const MatrixXd H = scaled_B(C.transpose(), units).transpose();
  const double size = F.norm();
  for (const Complex& mode : eigenvalues_of(F)) {
    if (mode.imag() < 0.0 || std::abs(mode.real()) > 1e-4 * std::max(size, std::abs(mode))) {
      continue;
    }
    Eigen::MatrixXcd pencil(n + H.rows(), n);
    pencil.topRows(n) = F.cast<Complex>();
    pencil.topRows(n).diagonal().array() -= Complex(0.0, mode.imag());
    pencil.bottomRows(H.rows()) = H.cast<Complex>();
    const Eigen::VectorXd values = singular_values_of_complex(pencil);
    if (values(n - 1) <= 100.0 * static_cast<double>(n) * epsilon * values(0)) {
      return Complex(0.0, std::ldexp(mode.imag(), units.time));
    }
  }
  return std::nullopt;
}

}  // namespace

Expected<NormalizedPlant> normalized(Partition P, std::string_view where) {
  const Index m2 = P.B2.cols();
  const Index p2 = P.C2.rows();
  const Index m1 = P.B1.cols();
  const Index p1 = P.C1.rows();
  constexpr double small = 1e-13;
  const auto full = [](const Eigen::VectorXd& values, Index rank) {
    return values.size() >= rank && values(0) > 0.0 && values(rank - 1) > small * values(0);
  };
  const auto rank_of = [](const Eigen::VectorXd& values) {
    Index rank = 0;
    while (rank < values.size() && values(rank) > small * values(0) && values(0) > 0.0) {
      ++rank;
    }
    return std::to_string(rank);
  };
  const SingularValues out = svd_of(P.D12);
  if (!full(out.values, m2)) {
    return refusal(SynthesisError::control_without_weight, where, "D12")
        .got("of rank " + rank_of(out.values))
        .expected("of rank " + std::to_string(m2) + ", the number of controls")
        .hint("weight every control at high frequencies (W2), be it by a small number");
  }
  const SingularValues in = svd_of(P.D21);
  if (!full(in.values, p2)) {
    return refusal(SynthesisError::measurement_without_noise, where, "D21")
        .got("of rank " + rank_of(in.values))
        .expected("of rank " + std::to_string(p2) + ", the number of measurements")
        .hint("add a disturbance to every measurement, be it a small one");
  }
  NormalizedPlant N;
  // D₁₂ = U [Σ; 0] Vᵀ, turned so that the unit is below; D₂₁ = U [Σ 0] Vᵀ, so that it is right.
  MatrixXd errors(p1, p1);
  errors << out.U.rightCols(p1 - m2), out.U.leftCols(m2);
  MatrixXd disturbances(m1, m1);
  disturbances << in.V.rightCols(m1 - p2), in.V.leftCols(p2);
  N.controls = out.V * out.values.head(m2).cwiseInverse().asDiagonal();
  N.measurements = in.values.head(p2).cwiseInverse().asDiagonal() * MatrixXd(in.U.transpose());
  N.D22 = P.D22;
  N.P = {P.A,
         product(P.B1, disturbances),
         product(P.B2, N.controls),
         transposed_product(errors, P.C1),
         product(N.measurements, P.C2),
         product(transposed_product(errors, P.D11), disturbances),
         MatrixXd::Zero(p1, m2),
         MatrixXd::Zero(p2, m1),
         MatrixXd::Zero(p2, m2),
         P.n};
  N.P.D12.bottomRows(m2).setIdentity();
  N.P.D21.rightCols(p2).setIdentity();
  return N;
}

Expected<void> check_assumptions(const NormalizedPlant& plant, bool discrete,
                                 std::string_view where) {
  const Partition& P = plant.P;
  FLYBALL_TRY_IN(where, const auto reach,
                 analyze_controllability(P.A, P.B2, TimeDomain::continuous));
  FLYBALL_CHECK(check_modes(reach, reach.stabilizable, discrete, SynthesisError::not_stabilizable,
                            where, "(A, B2)",
                            "give the mode a control, or move a pole of a weight that lies on or "
                            "right of the border of stability into it"));
  FLYBALL_TRY_IN(where, const auto sight, analyze_observability(P.A, P.C2, TimeDomain::continuous));
  FLYBALL_CHECK(check_modes(sight, sight.detectable, discrete, SynthesisError::not_detectable,
                            where, "(C2, A)",
                            "measure the mode, or move a pole of a weight that lies on or right of "
                            "the border of stability into it"));
  // The zeros of P₁₂ are the modes of A - B₂D₁₂ᵀC₁ that the other rows of C₁ do not see.
  const Index m2 = P.B2.cols();
  const Index p2 = P.C2.rows();
  const MatrixXd A1 = P.A - product(P.B2, P.C1.bottomRows(m2));
  if (const auto zero = axis_mode(A1, P.C1.topRows(P.C1.rows() - m2))) {
    const Complex at = told(*zero, discrete);
    return refusal(SynthesisError::control_zero_on_axis, where, "P12")
        .got("without full column rank at a zero")
        .hint(
            "weight the controls or the errors at that frequency, or move the plant's or weight's "
            "pole or zero there into the stable region a little")
        .with("zero", {at.real(), at.imag()});
  }
  const MatrixXd A2 = P.A - product(P.B1.rightCols(p2), P.C2);
  const MatrixXd rest = P.B1.leftCols(P.B1.cols() - p2);
  if (const auto zero = axis_mode(A2.transpose(), rest.transpose())) {
    const Complex at = told(*zero, discrete);
    return refusal(SynthesisError::measurement_zero_on_axis, where, "P21")
        .got("without full row rank at a zero")
        .hint(
            "let a disturbance act on the plant's input at that frequency, or move the pole or "
            "zero "
            "there into the stable region a little")
        .with("zero", {at.real(), at.imag()});
  }
  return {};
}

Expected<ContinuousSystem<>> denormalized(const NormalizedPlant& plant, const ContinuousSystem<>& K,
                                          std::string_view where) {
  const MatrixXd B = product(K.B, plant.measurements);
  const MatrixXd C = product(plant.controls, K.C);
  const MatrixXd D = product(plant.controls, product(K.D, plant.measurements));
  // u = C q + D (y - D₂₂u).
  const Index m = D.rows();
  MatrixXd right(m, C.cols() + D.cols());
  right << C, D;
  FLYBALL_TRY(const MatrixXd U,
              solve_algebraic_loop(
                  {D, plant.D22, 1.0, "I + D_K D22", "give the path from u to y a little dynamics"},
                  right, where));
  const MatrixXd late = product(B, product(plant.D22, U));
  return ContinuousSystem<>{K.A - late.leftCols(C.cols()), B - late.rightCols(D.cols()),
                            U.leftCols(C.cols()), U.rightCols(D.cols())};
}

}  // namespace detail

}  // namespace flyball
