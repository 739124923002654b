#include <flyball/math/probability/density.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <flyball/math/integration/quadrature.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

constexpr QuadratureOptions accuracy{.relative_tolerance = 1e-11, .absolute_tolerance = 1e-14};
/// Within a quadrature, whose tolerance its errors must not reach.
constexpr QuadratureOptions inner{.relative_tolerance = 1e-13, .absolute_tolerance = 1e-16};

Error not_a_density(std::string_view where, double mass) {
  return refusal(ArgumentError::out_of_range, where, "the total probability")
      .got(format_number(mass, 10))
      .expected("1")
      .hint("give ends within which the density lies");
}

Expected<void> check_mass(double mass, std::string_view where) {
  if (!(std::abs(mass - 1.0) <= 1e-6)) {
    return tl::unexpected(not_a_density(where, mass));
  }
  return {};
}

/// ∫ f(x) p(x) dx, p looked at.
template <class F>
Expected<double> weighted(const F& f, Density p, Support support, std::string_view where,
                          const QuadratureOptions& options = accuracy) {
  std::optional<double> negative;
  const auto integrand = [&](double x) {
    const double density = p(x);
    if (density < 0.0) {
      negative = x;
    }
    return density == 0.0 ? 0.0 : f(x) * density;
  };
  auto integral = quadrature(integrand, support.low, support.high, options);
  if (negative) {
    return refusal(ArgumentError::out_of_range, where, "the density")
        .got("negative")
        .expected("a density, nowhere below zero")
        .with("at", *negative);
  }
  if (!integral) {
    return tl::unexpected(std::move(integral).error());
  }
  return integral->value;
}

/// ∬ f p over the plane; the first refusal of an inner integral is that of the whole.
template <class F>
Expected<double> weighted(const F& f, JointDensity p, Support of_x, Support of_y,
                          std::string_view where) {
  std::optional<Error> refused;
  const auto row = [&](double y) {
    const auto integral = weighted([&](double x) { return f(x, y); },
                                   [&](double x) { return p(x, y); }, of_x, where, inner);
    if (!integral && !refused) {
      refused = integral.error();
    }
    return integral ? *integral : 0.0;
  };
  auto integral = quadrature(row, of_y.low, of_y.high, accuracy);
  if (refused) {
    return tl::unexpected(*refused);
  }
  if (!integral) {
    return tl::unexpected(std::move(integral).error());
  }
  return integral->value;
}

/// Mean and variance of p/mass.
Expected<Moments> scaled_moments(Density p, double mass, Support support, std::string_view where) {
  FLYBALL_TRY(const double first, weighted([](double x) { return x; }, p, support, where));
  const double mean = first / mass;
  FLYBALL_TRY(const double second,
              weighted([&](double x) { return (x - mean) * (x - mean); }, p, support, where));
  return Moments{mean, second / mass};
}

constexpr auto one = [](auto...) { return 1.0; };

}  // namespace

Expected<double> probability(Density p, double low, double high) {
  return weighted(one, p, {low, high}, "probability");
}

Expected<double> expectation(FunctionRef<double(double)> f, Density p, Support support) {
  constexpr std::string_view where = "expectation";
  FLYBALL_TRY(const double mass, weighted(one, p, support, where));
  FLYBALL_CHECK(check_mass(mass, where));
  return weighted(f, p, support, where);
}

Expected<Moments> moments(Density p, Support support) {
  constexpr std::string_view where = "moments";
  FLYBALL_TRY(const double mass, weighted(one, p, support, where));
  FLYBALL_CHECK(check_mass(mass, where));
  return scaled_moments(p, mass, support, where);
}

Expected<double> marginal(JointDensity p, double x, Support of_y) {
  return weighted(one, [&](double y) { return p(x, y); }, of_y, "marginal");
}

Expected<Moments> conditional_moments(JointDensity p, double y, Support of_x) {
  constexpr std::string_view where = "conditional_moments";
  const auto slice = [&](double x) { return p(x, y); };
  FLYBALL_TRY(const double mass, weighted(one, slice, of_x, where));
  if (!(mass > 0.0)) {
    return refusal(ArgumentError::out_of_range, where, "y")
        .got(format_number(y))
        .expected("a value that happens: the density there is zero for every x");
  }
  return scaled_moments(slice, mass, of_x, where);
}

Expected<double> expectation(FunctionRef<double(double, double)> f, JointDensity p, Support of_x,
                             Support of_y) {
  constexpr std::string_view where = "expectation";
  FLYBALL_TRY(const double mass, weighted(one, p, of_x, of_y, where));
  FLYBALL_CHECK(check_mass(mass, where));
  return weighted(f, p, of_x, of_y, where);
}

Expected<JointMoments> joint_moments(JointDensity p, Support of_x, Support of_y) {
  constexpr std::string_view where = "joint_moments";
  FLYBALL_TRY(const double mass, weighted(one, p, of_x, of_y, where));
  FLYBALL_CHECK(check_mass(mass, where));
  const auto expected = [&](const auto& f) { return weighted(f, p, of_x, of_y, where); };
  FLYBALL_TRY(const double x_bar, expected([](double x, double) { return x; }));
  FLYBALL_TRY(const double y_bar, expected([](double, double y) { return y; }));
  const auto second = [&](int powers_of_x) {
    return expected([&, powers_of_x](double x, double y) {
      const double dx = x - x_bar;
      const double dy = y - y_bar;
      return powers_of_x == 2 ? dx * dx : powers_of_x == 1 ? dx * dy : dy * dy;
    });
  };
  FLYBALL_TRY(const double var_x, second(2));
  FLYBALL_TRY(const double cov_xy, second(1));
  FLYBALL_TRY(const double var_y, second(0));
  JointMoments result{{x_bar, y_bar}, Eigen::Matrix2d{{var_x, cov_xy}, {cov_xy, var_y}}};
  const double size = std::sqrt(var_x) * std::sqrt(var_y);
  result.correlation = size > 0.0 ? std::clamp(cov_xy / size, -1.0, 1.0) : 0.0;
  return result;
}

Expected<SampleMoments> sample_moments(const MatrixRef& samples) {
  constexpr std::string_view where = "sample_moments";
  if (samples.rows() == 0 || samples.cols() < 2) {
    return refusal(ArgumentError::empty, where, "samples")
        .got(detail::format("{} of {} entries", samples.cols(), samples.rows()))
        .expected("two or more, one a column");
  }
  FLYBALL_CHECK(check_finite(samples, where, "samples"));
  const auto count = static_cast<double>(samples.cols());
  SampleMoments result;
  result.mean = samples.rowwise().mean();
  Eigen::MatrixXd rest = samples.colwise() - result.mean;
  const Eigen::VectorXd rounding = rest.rowwise().mean();
  result.mean += rounding;
  rest.colwise() -= rounding;
  result.covariance = detail::symmetrized(detail::product_transposed(rest, rest)) / (count - 1.0);
  FLYBALL_TRY(result.correlation, correlation(result.covariance));
  return result;
}

Expected<Eigen::MatrixXd> correlation(const MatrixRef& covariance) {
  constexpr std::string_view where = "correlation";
  FLYBALL_CHECK(Checks(where)
                    .square(covariance, "the covariance")
                    .finite(covariance, "the covariance")
                    .symmetric(covariance, "the covariance"));
  const Eigen::Index n = covariance.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    FLYBALL_CHECK(check_not_negative(covariance(i, i), where, detail::format("variance {}", i)));
  }
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const double size = std::sqrt(covariance(i, i)) * std::sqrt(covariance(j, j));
      if (size > 0.0) {
        result(i, j) = i == j ? 1.0 : std::clamp(covariance(i, j) / size, -1.0, 1.0);
      }
    }
  }
  return result;
}

}  // namespace flyball
