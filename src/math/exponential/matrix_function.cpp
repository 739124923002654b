#include <flyball/math/exponential/matrix_function.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/exponential/extended_function.hpp"
#include "math/exponential/triangular_function.hpp"
#include "math/extended/double_double.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

Refusal no_answer(MatrixFunctionError code, std::string_view where, std::string_view what,
                  const Complex& eigenvalue) {
  return refusal(code, where)
      .got(std::string(what))
      .with("eigenvalue", std::vector<double>{eigenvalue.real(), eigenvalue.imag()});
}

/// A, balanced by powers of two d, as U T Uᴴ.
struct Triangularized {
  Eigen::VectorXd d;
  detail::ComplexSchur schur;
  double zero = 0.0;  ///< Eigenvalues up to here are zero for all that rounding leaves of them.

  [[nodiscard]] MatrixXd assemble(const MatrixXcd& F) const {
    const MatrixXcd UF = detail::complex_product(schur.U, F);
    const MatrixXd M = detail::product_transposed(MatrixXd(UF.real()), MatrixXd(schur.U.real())) +
                       detail::product_transposed(MatrixXd(UF.imag()), MatrixXd(schur.U.imag()));
    return d.asDiagonal() * M * d.cwiseInverse().asDiagonal();
  }
};

Triangularized triangularize(const MatrixRef& A) {
  Triangularized form;
  form.d = detail::balance_of(A);
  const MatrixXd M = form.d.cwiseInverse().asDiagonal() * A * form.d.asDiagonal();
  bool triangular = true;
  for (Index j = 0; j + 1 < M.cols() && triangular; ++j) {
    triangular = M.col(j).tail(M.rows() - j - 1).isZero(0.0);
  }
  if (triangular) {
    // Its eigenvalues are exact, however small.
    form.schur = {M.cast<Complex>(), MatrixXcd::Identity(M.rows(), M.cols()), true};
  } else {
    form.schur = detail::complex_schur_of(M);
    form.zero = 1e-15 * static_cast<double>(A.rows()) * detail::norm1(M);
  }
  return form;
}

MatrixXd whole_power(MatrixXd base, long long exponent) {
  MatrixXd result = MatrixXd::Identity(base.rows(), base.cols());
  for (; exponent > 0; exponent /= 2) {
    if (exponent % 2 == 1) {
      result = detail::product(result, base);
    }
    if (exponent > 1) {
      base = detail::product(base, base);
    }
  }
  return result;
}

/// Whether only the part on and below the diagonal has entries: f(A) = f(Aᵀ)ᵀ keeps it so, and its
/// small entries their digits.
bool is_lower_triangular(const MatrixRef& A) {
  for (Index j = 1; j < A.cols(); ++j) {
    if (!A.col(j).head(j).isZero(0.0)) {
      return false;
    }
  }
  return A.cols() > 1;
}

/// Whether two matrices that should be one differ by rounding, beside their largest entry or the
/// largest term of the product that made one.
bool agree(const MatrixXd& made, const MatrixRef& wanted, double terms = 0.0) {
  constexpr double share = 9e-11;
  return made.allFinite() && (made - wanted).cwiseAbs().maxCoeff() <=
                                 share * std::max(terms, wanted.cwiseAbs().maxCoeff());
}

Refusal not_accurate(std::string_view where) {
  return refusal(MatrixFunctionError::not_accurate, where, "A")
      .got("of entries too far apart for sixteen digits");
}

/// A balanced, with digits to spare.
struct Balanced {
  explicit Balanced(const MatrixRef& A)
      : d(detail::balance_of(A)), M(MatrixXd(d.cwiseInverse().asDiagonal() * A * d.asDiagonal())) {}
  [[nodiscard]] MatrixXd unbalanced(const detail::DoubleDoubleMatrix& F) const {
    return d.asDiagonal() * F.rounded() * d.cwiseInverse().asDiagonal();
  }

  Eigen::VectorXd d;
  detail::DoubleDoubleMatrix M;
};

/// A^f and what it is multiplied with to be A.
struct Fraction {
  MatrixXd power;
  MatrixXd rest;  ///< A^(1 - f)
};

/// A^f = e^(f log A) where the Schur form loses the large entries' digits in balanced units.
Expected<Fraction> power_in_twice(const MatrixRef& A, double f, std::string_view where) {
  const Balanced balanced(A);
  const auto L = detail::extended_logarithm(balanced.M);
  if (!L) {
    return not_accurate(where);
  }
  const auto power = [&](double p) {
    const detail::DoubleDoubleMatrix weight(MatrixXd::Identity(A.rows(), A.cols()) * p);
    return balanced.unbalanced(detail::extended_exponential(detail::product(weight, *L)));
  };
  Fraction made{power(f), power(1.0 - f)};
  const MatrixXd back =
      detail::product(detail::DoubleDoubleMatrix(made.power), detail::DoubleDoubleMatrix(made.rest))
          .rounded();
  if (!agree(back, A, detail::product(made.power.cwiseAbs(), made.rest.cwiseAbs()).maxCoeff())) {
    return not_accurate(where);
  }
  return made;
}

/// 0 < f < 1.
Expected<Fraction> fractional_power(const MatrixRef& given, double f, std::string_view where) {
  const bool lower = is_lower_triangular(given);
  const MatrixXd A = lower ? MatrixXd(given.transpose()) : MatrixXd(given);
  Triangularized form = triangularize(A);
  if (!form.schur.converged) {
    return no_answer(MatrixFunctionError::no_real_power, where,
                     "a matrix whose eigenvalues cannot be found", 0.0);
  }
  MatrixXcd& T = form.schur.T;
  const Index n = T.rows();
  Complex smallest = T(0, 0);
  for (Index i = 0; i < n; ++i) {
    const Complex lambda = T(i, i);
    if (std::abs(lambda) < std::abs(smallest)) {
      smallest = lambda;
    }
    if (lambda.real() < -form.zero && std::abs(lambda.imag()) <= form.zero) {
      return tl::unexpected(no_answer(MatrixFunctionError::no_real_power, where,
                                      "not real: an eigenvalue is negative", lambda)
                                .hint("round the power to a whole number"));
    }
  }
  Index rank = n;
  for (Index i = n - 1; i >= 0; --i) {
    if (std::abs(T(i, i)) <= form.zero) {
      --rank;
      detail::move_eigenvalue(T, form.schur.U, i, rank);
    }
  }
  const auto power = [&](double p) {
    // [T₁ T₁₂; 0 0]^p = [T₁^p T₁^p T₁⁻¹T₁₂; 0 0].
    MatrixXcd P = MatrixXcd::Zero(n, n);
    const MatrixXcd T1 = T.topLeftCorner(rank, rank);
    if (rank > 0) {
      const MatrixXcd P1 = detail::triangular_power(T1, p);
      P.topLeftCorner(rank, rank) = P1;
      if (rank < n) {
        P.topRightCorner(rank, n - rank) = detail::complex_product(
            P1, detail::solve_triangular(T1, T.topRightCorner(rank, n - rank)));
      }
    }
    return form.assemble(P);
  };
  const MatrixXd result = power(f);
  // A^f A^(1-f) = A holds for the principal power and fails where a defective zero spoils it; in
  // balanced units, so that large entries do not hide the small ones.
  const auto size = [&](const MatrixXd& M) {
    return detail::norm1(form.d.cwiseInverse().asDiagonal() * M * form.d.asDiagonal());
  };
  const MatrixXd rest = power(1.0 - f);
  const MatrixXd back = detail::product(result, rest);
  if (!result.allFinite() || !(size(back - A) <= 1e-7 * size(A))) {
    return tl::unexpected(no_answer(MatrixFunctionError::no_real_power, where,
                                    "not real: an eigenvalue near zero is defective", smallest)
                              .hint("round the power to a whole number"));
  }
  if (!agree(back, A, detail::product(result.cwiseAbs(), rest.cwiseAbs()).maxCoeff())) {
    return power_in_twice(given, f, where);
  }
  return lower ? Fraction{result.transpose(), rest.transpose()} : Fraction{result, rest};
}

/// The largest entry that A X and X A miss of I, beside its terms; infinity where X is not finite.
double inverse_error(const MatrixRef& A, const MatrixXd& X) {
  if (!X.allFinite()) {
    return std::numeric_limits<double>::infinity();
  }
  const auto error = [](const MatrixRef& left, const MatrixRef& right) {
    const MatrixXd missed =
        detail::product(left, right) - MatrixXd::Identity(left.rows(), left.cols());
    const MatrixXd terms = detail::product(left.cwiseAbs(), right.cwiseAbs());
    return (missed.array().abs() / terms.array().max(1.0)).maxCoeff();
  };
  return std::max(error(A, X), error(X, A));
}

/// A⁻¹, solved in balanced units and with rows of one size.
Expected<MatrixXd> inverse_of(const MatrixRef& A, std::string_view where) {
  const Eigen::VectorXd d = detail::balance_of(A);
  MatrixXd M = d.cwiseInverse().asDiagonal() * A * d.asDiagonal();
  MatrixXd rhs = MatrixXd::Identity(A.rows(), A.cols());
  for (Index i = 0; i < M.rows(); ++i) {
    const double largest = M.row(i).cwiseAbs().maxCoeff();
    const int exponent = largest > 0.0 && std::isfinite(largest) ? std::ilogb(largest) : 0;
    M.row(i) = detail::times_power(M.row(i), -exponent);
    rhs(i, i) = std::ldexp(1.0, -exponent);
  }
  double rcond = 0.0;
  const MatrixXd inverse = detail::solve_linear(M, rhs, &rcond);
  if (!(rcond > 0.0) || !inverse.allFinite()) {
    return refusal(MatrixFunctionError::singular, where, "A").with("reciprocal condition", rcond);
  }
  MatrixXd X = d.asDiagonal() * inverse * d.cwiseInverse().asDiagonal();
  if (inverse_error(A, X) <= 1e-12) {
    return X;
  }
  // Rows of sizes far apart: again in twice the precision.
  const auto exact = detail::solve(detail::DoubleDoubleMatrix(M), detail::DoubleDoubleMatrix(rhs));
  if (exact) {
    X = d.asDiagonal() * exact->rounded() * d.cwiseInverse().asDiagonal();
  }
  if (!(inverse_error(A, X) <= 1e-10)) {
    return not_accurate(where);
  }
  return X;
}

/// Whether X = A^-(k + f) and Y = A^-(1 - f) undo A^k and A, of f = 1/2 and k = 0 X² A = I, to
/// rounding beside the largest terms.
bool undoes(const MatrixXd& X, const MatrixXd& Y, const MatrixXd& A_k, const MatrixRef& A) {
  const MatrixXd inverse = detail::product(detail::product(X, A_k), Y);
  const double terms = std::max(detail::product(inverse.cwiseAbs(), A.cwiseAbs()).maxCoeff(),
                                inverse.cwiseAbs().maxCoeff() * A.cwiseAbs().maxCoeff());
  return agree(detail::product(inverse, A), MatrixXd::Identity(X.rows(), X.cols()), terms);
}

/// A^-(k + f), the inverse of the positive power: A⁻¹A^(1 - f) would lose as many digits as A has,
/// not as A^f has. An error of A^f may be more than one of A in its inverse: where they do not undo
/// A together, both are taken in twice the precision.
Expected<MatrixXd> negative_power(const MatrixRef& A, long long k, double f,
                                  const Fraction& fraction, std::string_view where) {
  const MatrixXd A_k = whole_power(A, k);
  const MatrixXd positive = detail::product(A_k, fraction.power);
  if (!positive.allFinite()) {
    return refusal(MatrixFunctionError::overflow, where);
  }
  const auto X = inverse_of(positive, where);
  if (!X && X.error().is(MatrixFunctionError::singular)) {
    return X;
  }
  if (const auto Y = inverse_of(fraction.rest, where); X && Y && undoes(*X, *Y, A_k, A)) {
    return X;
  }
  const Balanced balanced(A);
  const auto L = detail::extended_logarithm(balanced.M);
  if (!L) {
    return not_accurate(where);
  }
  const auto power = [&](double p) {
    const detail::DoubleDoubleMatrix weight(MatrixXd::Identity(A.rows(), A.cols()) * p);
    return balanced.unbalanced(detail::extended_exponential(detail::product(weight, *L)));
  };
  MatrixXd better = power(-(static_cast<double>(k) + f));
  if (!undoes(better, power(f - 1.0), A_k, A)) {
    return not_accurate(where);
  }
  return better;
}

/// L, where e^L is A; else log A in twice the precision.
Expected<MatrixXd> confirmed(const MatrixRef& A, MatrixXd L) {
  if (const auto back = expm(L); back && agree(*back, A)) {
    return L;
  }
  const Balanced balanced(A);
  const auto better = detail::extended_logarithm(balanced.M);
  if (!better) {
    return not_accurate("logm");
  }
  L = balanced.unbalanced(*better);
  const Balanced answer(L);
  if (!agree(answer.unbalanced(detail::extended_exponential(answer.M)), A)) {
    return not_accurate("logm");
  }
  return L;
}

/// log(A / 2^unit), whose errors speak of A's eigenvalues.
Expected<MatrixXd> logarithm(const MatrixRef& A, int unit) {
  constexpr std::string_view where = "logm";
  // Near the identity A - I has digits that the Schur form of A would round away.
  const MatrixXd X = A - MatrixXd::Identity(A.rows(), A.cols());
  if (detail::norm1(X) <= detail::near_identity) {
    return detail::logarithm_near_identity(X);
  }
  const bool lower = is_lower_triangular(A);
  const Triangularized form = lower ? triangularize(MatrixXd(A.transpose())) : triangularize(A);
  if (!form.schur.converged) {
    return no_answer(MatrixFunctionError::no_real_logarithm, where,
                     "a matrix whose eigenvalues cannot be found", 0.0);
  }
  for (const Complex& lambda : form.schur.T.diagonal()) {
    if (lambda == 0.0 || (lambda.real() < 0.0 && std::abs(lambda.imag()) <= form.zero)) {
      const bool zero = std::abs(lambda) <= form.zero;
      return no_answer(MatrixFunctionError::no_real_logarithm, where,
                       zero ? "a singular matrix" : "a negative real eigenvalue",
                       lambda * std::ldexp(1.0, unit));
    }
  }
  MatrixXd L = form.assemble(detail::triangular_logarithm(form.schur.T));
  if (!L.allFinite()) {
    return refusal(MatrixFunctionError::overflow, where);
  }
  return lower ? MatrixXd(L.transpose()) : L;
}

}  // namespace

ErrorInfo error_info(MatrixFunctionError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_real_logarithm", "the matrix has no real principal logarithm", ErrorKind::no_answer},
      {"no_real_power", "the matrix has no real principal power of this exponent",
       ErrorKind::no_answer},
      {"singular", "a negative power needs a matrix with an inverse", ErrorKind::no_answer},
      {"overflow", "the answer exceeds the largest double", ErrorKind::no_answer},
      {"not_accurate", "no answer was found that could be confirmed", ErrorKind::no_answer},
  };
  return detail::info_of(code, "matrix_function", rows);
}

namespace {

/// log A of an A in ordinary units of its states.
Expected<MatrixXd> logarithm_of(const MatrixRef& A) {
  if (detail::unit_of(A) != 0) {
    // Between the largest and the smallest, so that neither is lost.
    const double least =
        (A.array() == 0.0).select(A.cwiseAbs().maxCoeff(), A.cwiseAbs()).minCoeff();
    const int unit = (std::ilogb(A.cwiseAbs().maxCoeff()) + std::ilogb(least)) / 2;
    const MatrixXd scaled = detail::times_power(A, -unit);
    FLYBALL_TRY(MatrixXd rough, logarithm(scaled, unit));
    FLYBALL_TRY(MatrixXd L, confirmed(scaled, std::move(rough)));
    L.diagonal().array() += unit * std::numbers::ln2;
    return L;
  }
  FLYBALL_TRY(MatrixXd L, logarithm(A, 0));
  return confirmed(A, std::move(L));
}

/// f(A) = D f(D⁻¹AD) D⁻¹, in units in which no entry of D⁻¹AD is beyond its cycles, where those of
/// A are too far apart for doubles to be their units.
/// @param degree  Of f(cA) = c^degree f(A), which lets the largest entry be near one; 0: it does
/// not.
template <class Function>
Expected<MatrixXd> in_units(const MatrixRef& A, std::string_view where, const Function& f,
                            double degree = 0.0) {
  constexpr double cycles_alone = -std::numeric_limits<double>::infinity();
  const auto units = A.rows() > 1 ? detail::far_units_of(A, cycles_alone) : std::nullopt;
  if (!units) {
    return f(A);
  }
  const int unit = degree == 0.0 ? 0 : detail::largest_exponent(A, -units->d, units->d);
  constexpr double beyond_any = 9999.0;
  const int back = static_cast<int>(std::clamp(degree * unit, -beyond_any, beyond_any));
  FLYBALL_TRY(const MatrixXd made, f(units->there(A, -unit)));
  MatrixXd given = units->back(made, back);
  if (!given.allFinite()) {
    return refusal(MatrixFunctionError::overflow, where);
  }
  return given;
}

/// Quotients such as L/T of decimal fractions are seldom whole to the last bit.
bool is_whole(double power) {
  return std::abs(power - std::round(power)) <= 1e-12 * std::max(1.0, std::abs(power));
}

/// A^power, both finite.
Expected<MatrixXd> power_of(const MatrixRef& A, double power) {
  constexpr std::string_view where = "powm";
  const bool whole = is_whole(power);
  const double magnitude = std::abs(whole ? std::round(power) : power);
  const double integer = std::floor(magnitude);
  MatrixXd base = A;
  if (power < 0.0 && whole && integer > 0.0) {
    FLYBALL_TRY(base, inverse_of(A, where));
  }
  MatrixXd result = whole_power(base, static_cast<long long>(integer));
  if (!whole) {
    const auto fraction = fractional_power(A, magnitude - integer, where);
    if (!fraction) {
      return tl::unexpected(Error(fraction.error()).about("the power " + format_number(power)));
    }
    if (power < 0.0) {
      return negative_power(A, static_cast<long long>(integer), magnitude - integer, *fraction,
                            where);
    }
    result = detail::product(result, fraction->power);
  }
  if (!result.allFinite()) {
    return refusal(MatrixFunctionError::overflow, where);
  }
  return result;
}

}  // namespace

Expected<MatrixXd> logm(const MatrixRef& A) {
  FLYBALL_CHECK(Checks("logm").square(A, "A").finite(A, "A"));
  return in_units(A, "logm", [](const MatrixRef& M) { return logarithm_of(M); });
}

Expected<MatrixXd> powm(const MatrixRef& A, double power) {
  constexpr std::string_view where = "powm";
  FLYBALL_CHECK(Checks(where).square(A, "A").finite(A, "A").finite(power, "power"));
  constexpr double largest = 1e9;
  if (std::abs(power) > largest) {
    return refusal(ArgumentError::out_of_range, where, "power")
        .got(format_number(power))
        .expected("at most 1e9 in magnitude");
  }
  const bool whole = is_whole(power);
  auto made = in_units(
      A, where, [&](const MatrixRef& M) { return power_of(M, power); },
      whole ? std::round(power) : 0.0);
  if (made && whole && power < 0.0) {
    // An inverse that undoes A in other units need not in the given ones.
    const MatrixXd forward = whole_power(A, static_cast<long long>(-std::round(power)));
    if (forward.allFinite() && !(inverse_error(forward, *made) <= 1e-10)) {
      return power_of(A, power);
    }
  }
  return made;
}

}  // namespace flyball
