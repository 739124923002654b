#include <flyball/control/latency.hpp>

#include <cmath>
#include <complex>
#include <vector>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <unsupported/Eigen/MatrixFunctions>

#include <flyball/math/matrix_exponential.hpp>

namespace flyball {

namespace {

Eigen::MatrixXd whole_power(Eigen::MatrixXd base, long long exponent) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Identity(base.rows(), base.cols());
  for (; exponent > 0; exponent /= 2) {
    if (exponent % 2 == 1) {
      result = (result * base).eval();
    }
    base = (base * base).eval();
  }
  return result;
}

Error no_real_power(double p, const std::complex<double>& eigenvalue, std::string_view what) {
  return Error(LatencyError::no_real_power)
      .in("matrix_power")
      .about(fmt::format("the power {}", format_number(p)))
      .got(fmt::format("not real: {}", what))
      .hint("round the power to a whole number")
      .with("eigenvalue", std::vector<double>{eigenvalue.real(), eigenvalue.imag()});
}

// M^f, 0 < f < 1.
Expected<Eigen::MatrixXd> fractional_power(const Eigen::MatrixXd& M, double f, double p) {
  const double size = M.cwiseAbs().rowwise().sum().maxCoeff();
  if (size == 0.0) {
    return M;
  }
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(M, false);
  if (solver.info() != Eigen::Success) {
    return tl::unexpected(no_real_power(p, {0.0, 0.0}, "its eigenvalues cannot be found"));
  }
  const double zero = 1e-15 * static_cast<double>(M.rows()) * size;
  std::complex<double> smallest = solver.eigenvalues()(0);
  for (const std::complex<double>& eigenvalue : solver.eigenvalues()) {
    if (std::abs(eigenvalue) < std::abs(smallest)) {
      smallest = eigenvalue;
    }
    if (eigenvalue.real() < -zero && std::abs(eigenvalue.imag()) <= zero) {
      return tl::unexpected(no_real_power(p, eigenvalue, "an eigenvalue is negative"));
    }
  }
  const Eigen::MatrixXd power = M.pow(f);
  // M^f M^{1-f} = M holds for the principal power and fails where a defective zero spoils it.
  const Eigen::MatrixXd product = power * M.pow(1.0 - f);
  if (!power.allFinite() || !((product - M).cwiseAbs().maxCoeff() <= 1e-7 * size)) {
    return tl::unexpected(no_real_power(p, smallest, "an eigenvalue near zero is defective"));
  }
  return power;
}

Expected<void> check_gain(const MatrixRef& K, const MatrixRef& A, const MatrixRef& B,
                          Time latency) {
  constexpr std::string_view where = "compensate_latency";
  if (auto square = check_square(A, where, "A"); !square) {
    return square;
  }
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  return check_all(check_shape(B, n, m, where, "B", "states x inputs"),
                   check_shape(K, m, n, where, "K", "inputs x states"), check_finite(A, where, "A"),
                   check_finite(B, where, "B"), check_finite(K, where, "K"),
                   check_not_negative(latency.si(), where, "latency", "s"));
}

}  // namespace

ErrorInfo error_info(LatencyError) {
  return {"latency", "no_real_power", "the power of the closed loop is not real",
          ErrorKind::no_answer};
}

Expected<Eigen::MatrixXd> matrix_power(const MatrixRef& M, double p) {
  constexpr std::string_view where = "matrix_power";
  if (auto square = check_square(M, where, "M"); !square) {
    return tl::unexpected(square.error());
  }
  if (auto checked = check_all(check_finite(M, where, "M"), check_not_negative(p, where, "p"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  constexpr double largest = 1e9;
  if (p > largest) {
    return tl::unexpected(Error(ArgumentError::out_of_range)
                              .in(std::string(where))
                              .about("p")
                              .got(format_number(p))
                              .expected("at most 1e9"));
  }
  // L/T of decimal fractions is seldom whole to the last bit.
  const double nearest = std::round(p);
  if (std::abs(p - nearest) <= 1e-12 * std::max(1.0, p)) {
    return whole_power(M, static_cast<long long>(nearest));
  }
  const double whole = std::floor(p);
  return fractional_power(M, p - whole, p).map([&](const Eigen::MatrixXd& fraction) {
    return Eigen::MatrixXd(whole_power(M, static_cast<long long>(whole)) * fraction);
  });
}

Expected<Eigen::MatrixXd> compensate_latency(const MatrixRef& K, const MatrixRef& A,
                                             const MatrixRef& B, Time period, Time latency) {
  constexpr std::string_view where = "compensate_latency";
  if (auto checked = check_gain(K, A, B, latency); !checked) {
    return tl::unexpected(checked.error());
  }
  if (auto checked = check_positive(period.si(), where, "period", "s"); !checked) {
    return tl::unexpected(checked.error());
  }
  auto power = matrix_power(A - B * K, latency.si() / period.si());
  if (!power) {
    return tl::unexpected(Error(std::move(power.error()).in(std::string(where))));
  }
  return Eigen::MatrixXd(K * *power);
}

namespace detail {

Expected<Eigen::MatrixXd> compensate_latency_continuous(const MatrixRef& K, const MatrixRef& A,
                                                        const MatrixRef& B, Time latency) {
  if (auto checked = check_gain(K, A, B, latency); !checked) {
    return tl::unexpected(checked.error());
  }
  return expm((A - B * K) * latency.si()).map([&](const Eigen::MatrixXd& exponential) {
    return Eigen::MatrixXd(K * exponential);
  });
}

}  // namespace detail

}  // namespace flyball
