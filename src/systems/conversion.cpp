#include <flyball/systems/conversion.hpp>

#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include <flyball/core/text.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "systems/hold_units.hpp"
#include "systems/matched_poles.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::product;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr std::array<std::string_view, 6> names{
    "zoh", "foh", "tustin", "forward-euler", "backward-euler", "matched"};

/// I + factor A or its right hand sides are solved for: A balanced, so that the states' units do
/// not decide what is singular.
class Shifted {
 public:
  /// constant I + factor A.
  Shifted(const MatrixXd& A, double constant, double factor)
      : A_(A), d_(detail::balance_of(A)), factor_(factor), constant_(constant) {
    balanced_ = d_.cwiseInverse().asDiagonal() * A * d_.asDiagonal();
    matrix_ = factor * balanced_;
    matrix_.diagonal().array() += constant;
  }

  /// @param forbidden  The eigenvalue of A that makes it singular.
  [[nodiscard]] Expected<void> check(double forbidden, std::string_view where,
                                     std::string_view method) const {
    const Eigen::VectorXcd eigenvalues = detail::eigenvalues_of(A_);
    const double blur = epsilon * balanced_.norm() * std::abs(factor_);
    for (const Complex& lambda : eigenvalues) {
      const double gap = std::abs(constant_ + factor_ * lambda);
      if (gap > 4.0 * (blur + epsilon * (std::abs(constant_) + std::abs(factor_ * lambda)))) {
        continue;
      }
      return refusal(SystemError::no_image, where, "A")
          .got("with an eigenvalue that " + std::string(method) + " maps to infinity")
          .expected("without the eigenvalue " + format_number(forbidden))
          .hint("choose another period or zoh")
          .with("eigenvalue", std::vector<double>{lambda.real(), lambda.imag()});
    }
    return {};
  }

  [[nodiscard]] MatrixXd solve(const MatrixXd& rhs) const {
    return d_.asDiagonal() * detail::solve_linear(matrix_, d_.cwiseInverse().asDiagonal() * rhs);
  }

  /// rhs (constant I + factor A)⁻¹.
  [[nodiscard]] MatrixXd solve_right(const MatrixXd& rhs) const {
    const MatrixXd transposed =
        detail::solve_linear(matrix_.transpose(), (rhs * d_.asDiagonal()).transpose());
    return transposed.transpose() * d_.cwiseInverse().asDiagonal();
  }

 private:
  MatrixXd A_;
  Eigen::VectorXd d_;
  double factor_;
  double constant_;
  MatrixXd balanced_;
  MatrixXd matrix_;
};

/// T, or 2 tan(ωT/2)/ω, at which the bilinear transform is exact at ω.
double warped(double T, double omega) {
  return omega > 0.0 ? 2.0 * std::tan(0.5 * omega * T) / omega : T;
}

Expected<void> check_arguments(Time period, ConversionMethod method, AngularVelocity prewarp,
                               std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .positive(period.si(), "period", "s")
                    .not_negative(prewarp.si(), "prewarp", "rad/s"));
  if (prewarp.si() == 0.0) {
    return {};
  }
  const double nyquist = std::numbers::pi / period.si();
  if (method != ConversionMethod::tustin) {
    return refusal(ArgumentError::out_of_range, where, "prewarp")
        .got("given for " + std::string(to_string(method)))
        .expected("zero: only tustin can be prewarped");
  }
  if (prewarp.si() >= nyquist) {
    return refusal(ArgumentError::out_of_range, where, "prewarp")
        .got(format_number(prewarp.si()) + " rad/s")
        .expected("below the Nyquist frequency, pi/T = " + format_number(nyquist) + " rad/s");
  }
  return {};
}

/// φ₁(AT) T and φ₂(AT) T, φ₁ = (eˣ - 1)/x, φ₂ = (eˣ - 1 - x)/x², and e^{AT}, from one exponential.
struct Holds {
  MatrixXd A;
  MatrixXd one;
  MatrixXd two;
};

Expected<Holds> holds_in_units(const MatrixXd& A, const MatrixXd& B, double T) {
  const Index n = A.rows();
  const Index m = B.cols();
  const double size = std::max(detail::norm1(A) * T, 1.0);
  const double size_B = detail::norm1(B) * T;
  const double scale = size_B > 0.0 ? std::exp2(std::round(std::log2(size / size_B))) : 1.0;
  MatrixXd block = MatrixXd::Zero(n + 2 * m, n + 2 * m);
  block.topLeftCorner(n, n) = A * T;
  block.block(0, n, n, m) = (B * scale) * T;
  block.block(n, n + m, m, m).setIdentity();
  FLYBALL_TRY(auto exponential, expm(block));
  return Holds{exponential.topLeftCorner(n, n), exponential.block(0, n, n, m) / scale,
               exponential.block(0, n + m, n, m) / scale};
}

/// @param B  What the last two are multiplied with.
Expected<Holds> holds(const MatrixXd& A, const MatrixXd& B, double T, std::string_view where) {
  if (!detail::needs_hold_units(A, B, T)) {
    return holds_in_units(A, B, T);
  }
  const detail::HoldUnits units = detail::hold_units_of(A, B, T);
  if (!units.A.allFinite()) {
    return refusal(MatrixExponentialError::overflow, where, "A T")
        .got("beyond the largest double")
        .hint("shorten the period, or choose units in which the numbers are nearer to 1");
  }
  FLYBALL_TRY(auto there, holds_in_units(units.A, units.B, 1.0));
  const Eigen::VectorXi& d = units.states;
  Holds given{detail::times_powers(there.A, d, -d, 0),
              detail::times_powers(there.one, d, -units.inputs, 0),
              detail::times_powers(there.two, d, -units.inputs, 0)};
  if (!given.A.allFinite() || !given.one.allFinite() || !given.two.allFinite()) {
    return refusal(MatrixExponentialError::overflow, where, "the discrete system")
        .got("beyond the largest double")
        .hint("shorten the period, or choose units in which the numbers are nearer to 1");
  }
  return given;
}

/// A of the continuous system under zero- or first-order hold.
Expected<MatrixXd> logarithm(const MatrixXd& A, double T) {
  return logm(A).map([&](const MatrixXd& X) { return MatrixXd(X / T); });
}

}  // namespace

std::string_view to_string(ConversionMethod method) {
  const auto index = static_cast<std::size_t>(method);
  return index < names.size() ? names[index] : "unknown";
}

Expected<ConversionMethod> parse_conversion_method(std::string_view name) {
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (names[k] == name) {
      return static_cast<ConversionMethod>(k);
    }
  }
  const std::string nearest = nearest_name(name, names);
  return refusal(ArgumentError::unknown_name, {}, "method")
      .got('"' + std::string(name) + '"')
      .expected("zoh, foh, tustin, forward-euler, backward-euler or matched")
      .hint(nearest.empty() ? "" : "did you mean \"" + nearest + "\"?");
}

Expected<DiscreteSystem<>> convert_to_discrete(const ContinuousSystem<>& system, Time period,
                                               ConversionMethod method, AngularVelocity prewarp) {
  constexpr std::string_view where = "discretize";
  FLYBALL_CHECK(check_system_or_gain(system, where));
  FLYBALL_CHECK(check_arguments(period, method, prewarp, where));
  const auto& [A, B, C, D] = system;
  const Index n = A.rows();
  const double T =
      method == ConversionMethod::tustin ? warped(period.si(), prewarp.si()) : period.si();
  DiscreteSystem<> discrete{A, B, C, D, period};
  if (n == 0) {
    return discrete;
  }
  switch (method) {
    case ConversionMethod::zoh: {
      FLYBALL_TRY(auto held, discretize_zoh(A, B, period));
      discrete.A = std::move(held.A);
      discrete.B = std::move(held.B);
      break;
    }
    case ConversionMethod::foh: {
      FLYBALL_TRY(const auto parts, holds(A, B, T, where));
      discrete.A = parts.A;
      discrete.B = parts.one - parts.two + product(parts.A, parts.two);
      discrete.D = D + product(C, parts.two);
      break;
    }
    case ConversionMethod::tustin:
    case ConversionMethod::backward_euler: {
      // θ = 1/2 or 1: A_d = (I - θTA)⁻¹(I + (1 - θ)TA).
      const double theta = method == ConversionMethod::tustin ? 0.5 : 1.0;
      const Shifted shifted(A, 1.0, -theta * T);
      FLYBALL_CHECK(shifted.check(1.0 / (theta * T), where, to_string(method)));
      discrete.A = shifted.solve(MatrixXd::Identity(n, n) + (1.0 - theta) * T * A);
      discrete.B = shifted.solve(T * B);
      discrete.C = shifted.solve_right(C);
      discrete.D = D + theta * product(C, discrete.B);
      break;
    }
    case ConversionMethod::forward_euler:
      discrete.A = MatrixXd::Identity(n, n) + T * A;
      discrete.B = T * B;
      break;
    case ConversionMethod::matched:
      return detail::match_to_discrete(system, period);
  }
  return check_system(discrete, where).map([&] { return discrete; });
}

Expected<ContinuousSystem<>> convert_to_continuous(const DiscreteSystem<>& system,
                                                   ConversionMethod method,
                                                   AngularVelocity prewarp) {
  constexpr std::string_view where = "undiscretize";
  FLYBALL_CHECK(check_system_or_gain(system, where));
  FLYBALL_CHECK(check_arguments(system.period, method, prewarp, where));
  const auto& [A, B, C, D, period] = system;
  const Index n = A.rows();
  const MatrixXd I = MatrixXd::Identity(n, n);
  const double T =
      method == ConversionMethod::tustin ? warped(period.si(), prewarp.si()) : period.si();
  ContinuousSystem<> continuous{A, B, C, D};
  if (n == 0) {
    return continuous;
  }
  switch (method) {
    case ConversionMethod::zoh:
    case ConversionMethod::foh: {
      FLYBALL_TRY(continuous.A, logarithm(A, T));
      // In balanced units d, because φ₁ is inverted beside I.
      const Eigen::VectorXd d = detail::balance_of(A);
      const Eigen::VectorXd d_inverse = d.cwiseInverse();
      const MatrixXd found = d_inverse.asDiagonal() * continuous.A * d.asDiagonal();
      // B_d = T φ₁(AT) B, or T φ₁(AT)² B: φ₁ - φ₂ + eˣφ₂ = φ₁². The principal logarithm keeps φ₁
      // regular.
      FLYBALL_TRY(const auto parts, holds(found, I, T, where));
      MatrixXd balanced = detail::solve_linear(parts.one, d_inverse.asDiagonal() * B);
      if (method == ConversionMethod::foh) {
        balanced = T * detail::solve_linear(parts.one, balanced);
        continuous.D = D - product(C * d.asDiagonal(), product(parts.two, balanced));
      }
      continuous.B = d.asDiagonal() * balanced;
      break;
    }
    case ConversionMethod::tustin: {
      const Shifted shifted(A, 1.0, 1.0);
      FLYBALL_CHECK(shifted.check(-1.0, where, "tustin"));
      continuous.A = (2.0 / T) * shifted.solve(A - I);
      continuous.B = (2.0 / T) * shifted.solve(B);
      continuous.C = 2.0 * shifted.solve_right(C);
      continuous.D = D - 0.5 * product(continuous.C, B);
      break;
    }
    case ConversionMethod::forward_euler:
      continuous.A = (A - I) / T;
      continuous.B = B / T;
      break;
    case ConversionMethod::backward_euler: {
      const Shifted shifted(A, 0.0, 1.0);
      FLYBALL_CHECK(shifted.check(0.0, where, "backward-euler"));
      continuous.A = shifted.solve(A - I) / T;
      continuous.B = shifted.solve(B) / T;
      continuous.C = shifted.solve_right(C);
      continuous.D = D - product(continuous.C, B);
      break;
    }
    case ConversionMethod::matched:
      return detail::match_to_continuous(system);
  }
  return check_system(continuous, where).map([&] { return continuous; });
}

}  // namespace flyball
