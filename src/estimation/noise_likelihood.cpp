#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <flyball/estimation/covariance.hpp>
#include <flyball/estimation/noise_fit.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::string_view in_noise_likelihood = "noise_likelihood";

Expected<void> check_step(const NoiseStep& step, Index n, Index r, Index p, Index k) {
  const auto named = [&](std::string_view name) {
    return detail::format("{} of step {}", name, k);
  };
  const std::string of_A = named("A");
  const std::string of_C = named("C");
  const std::string of_G = named("G");
  const std::string of_input = named("input");
  const Index parts = step.G.empty() ? 0 : r;
  FLYBALL_CHECK(Checks(in_noise_likelihood)
                    .shape(step.A, n, n, of_A, "states x states")
                    .finite(step.A, of_A)
                    .shape(step.input, step.input.size() == 0 ? 0 : n, 1, of_input, "states x 1")
                    .finite(step.input, of_input)
                    .shape(step.C, p, n, of_C, "outputs x states")
                    .finite(step.C, of_C)
                    .shape(step.y, p, 1, named("y"), "outputs x 1"));
  if (static_cast<Index>(step.G.size()) != parts) {
    return refusal(ArgumentError::wrong_shape, in_noise_likelihood, of_G)
        .got(detail::format("{} matrices", step.G.size()))
        .expected(detail::format("{}, one for each deviation, or none", r));
  }
  for (const MatrixXd& G : step.G) {
    FLYBALL_CHECK(
        Checks(in_noise_likelihood).shape(G, n, n, of_G, "states x states").finite(G, of_G));
  }
  for (Index i = 0; i < p; ++i) {
    if (std::isinf(step.y(i))) {
      FLYBALL_CHECK(check_finite(step.y(i), in_noise_likelihood, named("y")));
    }
  }
  return {};
}

Expected<void> check_deviations(const VectorXd& values, std::string_view name) {
  FLYBALL_CHECK(Checks(in_noise_likelihood).finite(values, std::string(name)));
  for (Index i = 0; i < values.size(); ++i) {
    if (values(i) < 0.0) {
      return refusal(ArgumentError::out_of_range, in_noise_likelihood,
                     detail::format("{}({})", name, i))
          .got(detail::format("{}", values(i)))
          .expected("zero or greater");
    }
  }
  return {};
}

Expected<void> check(std::span<const NoiseRecord> records, const VectorXd& process,
                     const VectorXd& measurement) {
  FLYBALL_CHECK(check_deviations(process, "process"));
  FLYBALL_CHECK(check_deviations(measurement, "measurement"));
  for (const NoiseRecord& record : records) {
    const Index n = record.x0.size();
    FLYBALL_CHECK(Checks(in_noise_likelihood)
                      .finite(record.x0, "x0")
                      .shape(record.P0, n, n, "P0", "states x states"));
    FLYBALL_CHECK(check_covariance(record.P0, in_noise_likelihood, "P0"));
    Index k = 0;
    for (const NoiseStep& step : record.steps) {
      FLYBALL_CHECK(check_step(step, n, process.size(), measurement.size(), ++k));
    }
  }
  return {};
}

/// What the backward pass needs of a step.
struct Passed {
  std::vector<Index> there;  ///< The entries of y that are not missing.
  MatrixXd C;                ///< Their rows.
  MatrixXd inverse;          ///< S⁻¹
  VectorXd weighted;         ///< S⁻¹ν
  MatrixXd K;
  MatrixXd rest;  ///< I - K C
};

class Pass {
 public:
  Pass(const NoiseRecord& record, const VectorXd& process, const VectorXd& measurement)
      : record_(record),
        process_(process.cwiseAbs2()),
        measurement_(measurement.cwiseAbs2()),
        n_(record.x0.size()) {}

  /// @return log p; nothing where an innovation has no variance, which is at `failed()`.
  bool forward(double& log_likelihood) {
    VectorXd x = record_.x0;
    MatrixXd P = record_.P0;
    passed_.reserve(record_.steps.size());
    for (const NoiseStep& step : record_.steps) {
      x = detail::product(step.A, x);
      if (step.input.size() != 0) {
        x += step.input;
      }
      P = detail::product_transposed(detail::product(step.A, P), step.A);
      for (std::size_t i = 0; i < step.G.size(); ++i) {
        P += process_(static_cast<Index>(i)) * step.G[i];
      }
      Passed& now = passed_.emplace_back();
      if (!correct(step, x, P, now, log_likelihood)) {
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] std::size_t failed() const { return passed_.size(); }

  void backward(NoiseLikelihood& result) const {
    VectorXd r = VectorXd::Zero(n_);
    MatrixXd N = MatrixXd::Zero(n_, n_);
    for (std::size_t k = passed_.size(); k-- > 0;) {
      const Passed& now = passed_[k];
      const NoiseStep& step = record_.steps[k];
      if (!now.there.empty()) {
        const VectorXd u = now.weighted - detail::transposed_product(now.K, r);
        const MatrixXd D =
            now.inverse + detail::transposed_product(now.K, detail::product(N, now.K));
        for (std::size_t i = 0; i < now.there.size(); ++i) {
          const auto row = static_cast<Index>(i);
          result.by_log_measurement(now.there[i]) +=
              measurement_(now.there[i]) * (u(row) * u(row) - D(row, row));
        }
        r = detail::transposed_product(now.C, now.weighted) +
            detail::transposed_product(now.rest, r);
        N = detail::transposed_product(now.C, detail::product(now.inverse, now.C)) +
            detail::transposed_product(now.rest, detail::product(N, now.rest));
      }
      for (std::size_t i = 0; i < step.G.size(); ++i) {
        const auto row = static_cast<Index>(i);
        const double size = r.dot(detail::product(step.G[i], r).col(0));
        result.by_log_process(row) +=
            process_(row) * (size - N.cwiseProduct(step.G[i]).sum());  // both are symmetric
      }
      r = detail::transposed_product(step.A, r);
      N = detail::transposed_product(step.A, detail::product(N, step.A));
    }
  }

 private:
  bool correct(const NoiseStep& step, VectorXd& x, MatrixXd& P, Passed& now,
               double& log_likelihood) const {
    for (Index i = 0; i < step.y.size(); ++i) {
      if (!std::isnan(step.y(i))) {
        now.there.push_back(i);
      }
    }
    const auto m = static_cast<Index>(now.there.size());
    if (m == 0) {
      return true;
    }
    now.C.resize(m, n_);
    VectorXd nu(m);
    MatrixXd R = MatrixXd::Zero(m, m);
    for (Index i = 0; i < m; ++i) {
      const Index row = now.there[static_cast<std::size_t>(i)];
      now.C.row(i) = step.C.row(row);
      nu(i) = step.y(row) - step.C.row(row).dot(x);
      R(i, i) = measurement_(row);
    }
    const MatrixXd PC = detail::product_transposed(P, now.C);
    const MatrixXd S = detail::symmetrized(detail::product(now.C, PC)) + R;
    const auto L = detail::cholesky_of(S);
    if (!L) {
      return false;
    }
    now.inverse = detail::symmetrized(detail::solve_symmetric(S, MatrixXd::Identity(m, m)));
    now.weighted = detail::product(now.inverse, nu);
    now.K = detail::product(PC, now.inverse);
    now.rest = MatrixXd::Identity(n_, n_) - detail::product(now.K, now.C);
    log_likelihood -=
        0.5 * (nu.dot(now.weighted) + static_cast<double>(m) * std::log(2.0 * std::numbers::pi)) +
        L->diagonal().array().log().sum();
    x += detail::product(now.K, nu);
    // Joseph's form.
    P = detail::product_transposed(detail::product(now.rest, P), now.rest) +
        detail::product_transposed(detail::product(now.K, R), now.K);
    P = detail::symmetrized(P);
    return std::isfinite(log_likelihood);
  }

  const NoiseRecord& record_;
  VectorXd process_;
  VectorXd measurement_;
  Index n_;
  std::vector<Passed> passed_;
};

}  // namespace

Expected<NoiseLikelihood> noise_likelihood(std::span<const NoiseRecord> records,
                                           const VectorXd& process, const VectorXd& measurement) {
  FLYBALL_CHECK(check(records, process, measurement));
  NoiseLikelihood result{0.0, VectorXd::Zero(process.size()), VectorXd::Zero(measurement.size())};
  for (const NoiseRecord& record : records) {
    Pass pass(record, process, measurement);
    if (!pass.forward(result.log_likelihood)) {
      return refusal(ArgumentError::not_positive, in_noise_likelihood,
                     detail::format("the innovation's covariance of step {}", pass.failed()))
          .got("singular, or not finite")
          .hint("a noise of measurement of zero, or deviations of very different sizes");
    }
    pass.backward(result);
  }
  return result;
}

MatrixXd step_noise(const MatrixRef& F, const MatrixRef& density, double dt) {
  const Index n = F.rows();
  const MatrixXd E = F - MatrixXd::Identity(n, n);
  const MatrixXd half = MatrixXd::Identity(n, n) + 0.5 * E - 0.125 * detail::product(E, E);
  const auto moved = [&](const MatrixXd& by) {
    return detail::product_transposed(detail::product(by, density), by);
  };
  return detail::symmetrized((dt / 6.0) * (density + 4.0 * moved(half) + moved(F)));
}

}  // namespace flyball
