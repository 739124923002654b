#include <flyball/math/probability/gaussian_vector.hpp>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/probability/conditioning.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const double log_two_pi = std::log(2.0 * std::numbers::pi);

/// A direction along which a covariance with this factor has no variance, in units in which the
/// others are one.
VectorXd certain_direction(const MatrixXd& factor) {
  VectorXd units = factor.rowwise().norm();
  for (Index i = 0; i < units.size(); ++i) {
    if (units(i) == 0.0) {
      return VectorXd::Unit(units.size(), i);
    }
  }
  const MatrixXd scaled = units.cwiseInverse().asDiagonal() * factor;
  const auto system = detail::symmetric_eigensystem_of(detail::product_transposed(scaled, scaled));
  return (units.cwiseInverse().cwiseProduct(system.vectors.col(0))).normalized();
}

MatrixXd rows_of_identity(std::span<const Index> entries, Index n) {
  MatrixXd C = MatrixXd::Zero(static_cast<Index>(entries.size()), n);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    C(static_cast<Index>(i), entries[i]) = 1.0;
  }
  return C;
}

Expected<void> check_entries(std::span<const Index> entries, Index n, std::string_view where) {
  if (entries.empty()) {
    return refusal(ArgumentError::empty, where, "entries").got("empty").expected("one or more");
  }
  std::vector<bool> seen(static_cast<std::size_t>(n), false);
  for (const Index entry : entries) {
    if (entry < 0 || entry >= n || seen[static_cast<std::size_t>(entry)]) {
      return refusal(ArgumentError::out_of_range, where, "an entry")
          .got(entry >= 0 && entry < n ? detail::format("{}, twice", entry)
                                       : detail::format("{}", entry))
          .expected(detail::format("from 0 to {}, each once at most", n - 1));
    }
    seen[static_cast<std::size_t>(entry)] = true;
  }
  return {};
}

Expected<void> check_difference(const VectorXd& difference, std::string_view where,
                                std::string_view name) {
  if (!difference.allFinite()) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got("further from what was expected than the largest double");
  }
  return {};
}

}  // namespace

ErrorInfo error_info(GaussianError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"no_density", "along some direction nothing is random", ErrorKind::no_answer},
      {"contradiction", "a value differs from what is certain of it", ErrorKind::no_answer},
  };
  return detail::info_of(code, "gaussian", rows);
}

GaussianVector::GaussianVector(VectorXd mean, MatrixXd covariance, MatrixXd factor)
    : mean_(std::move(mean)), covariance_(std::move(covariance)), factor_(std::move(factor)) {
  rank_ = detail::condition(MatrixXd(0, factor_.cols()), factor_, MatrixXd(mean_.size(), 0),
                            factor_.rowwise().norm())
              .rank;
}

GaussianVector::GaussianVector(VectorXd mean, const MatrixXd& factor)
    : GaussianVector(std::move(mean),
                     detail::symmetrized(detail::product_transposed(factor, factor)),
                     detail::compressed(factor)) {}

Expected<GaussianVector> GaussianVector::create(const VectorXd& mean, const MatrixRef& covariance) {
  constexpr std::string_view where = "GaussianVector";
  if (mean.size() == 0) {
    return refusal(ArgumentError::empty, where, "the mean").got("empty");
  }
  FLYBALL_CHECK(
      Checks(where)
          .finite(mean, "the mean")
          .shape(covariance, mean.size(), mean.size(), "the covariance", "entries x entries"));
  FLYBALL_TRY(auto factor, detail::covariance_factor(covariance, where, "the covariance"));
  return GaussianVector(mean, detail::symmetrized(covariance), std::move(factor));
}

Expected<double> GaussianVector::squared_distance(const VectorXd& x) const {
  constexpr std::string_view where = "squared_distance";
  FLYBALL_CHECK(Checks(where).shape(x, mean_.size(), 1, "x", "entries x 1").finite(x, "x"));
  FLYBALL_CHECK(check_difference(x - mean_, where, "x"));
  const auto of = detail::condition(MatrixXd(0, factor_.cols()), factor_, MatrixXd(mean_.size(), 0),
                                    factor_.rowwise().norm());
  Index contradicted = -1;
  const double distance =
      of.squared_distance(x - mean_, x.cwiseAbs() + mean_.cwiseAbs(), contradicted);
  if (contradicted >= 0) {
    const VectorXd direction = certain_direction(factor_);
    return refusal(GaussianError::contradiction, where, detail::format("x({})", contradicted))
        .got(format_number(x(contradicted)))
        .expected("what is certain of it")
        .with("mean", mean_(contradicted))
        .with("certain direction", std::vector<double>(direction.begin(), direction.end()));
  }
  return distance;
}

Expected<double> GaussianVector::log_density(const VectorXd& x) const {
  constexpr std::string_view where = "log_density";
  if (rank_ < mean_.size()) {
    const VectorXd direction = certain_direction(factor_);
    return refusal(GaussianError::no_density, where, "the covariance")
        .got("singular: along one direction nothing is random")
        .hint("take the marginal of entries that are random")
        .with("direction", std::vector<double>(direction.begin(), direction.end()));
  }
  FLYBALL_TRY(const double distance, squared_distance(x));
  const auto of = detail::condition(MatrixXd(0, factor_.cols()), factor_, MatrixXd(mean_.size(), 0),
                                    factor_.rowwise().norm());
  return -0.5 * (distance + of.log_determinant + static_cast<double>(mean_.size()) * log_two_pi);
}

VectorXd GaussianVector::sample(Random& random) const {
  VectorXd standard(factor_.cols());
  for (double& entry : standard) {
    entry = random.normal();
  }
  return mean_ + factor_ * standard;
}

Expected<MatrixXd> GaussianVector::samples(Index count, std::uint64_t seed) const {
  FLYBALL_CHECK(check_not_negative(static_cast<double>(count), "samples", "count"));
  Random random(seed);
  MatrixXd result(mean_.size(), count);
  for (Index k = 0; k < count; ++k) {
    result.col(k) = sample(random);
  }
  return result;
}

Expected<GaussianVector> GaussianVector::mapped(const MatrixRef& A, const VectorXd& b) const {
  constexpr std::string_view where = "mapped";
  FLYBALL_CHECK(Checks(where)
                    .shape(A, A.rows(), mean_.size(), "A", "any x entries")
                    .finite(A, "A")
                    .shape(b, b.size() == 0 ? 0 : A.rows(), 1, "b", "rows of A x 1")
                    .finite(b, "b"));
  if (A.rows() == 0) {
    return refusal(ArgumentError::empty, where, "A").got("empty");
  }
  VectorXd mean = detail::product(A, mean_);
  if (b.size() > 0) {
    mean += b;
  }
  return GaussianVector(std::move(mean), detail::product(A, factor_));
}

Expected<GaussianVector> GaussianVector::plus(const GaussianVector& y) const {
  FLYBALL_CHECK(check_shape(y.mean_, mean_.size(), 1, "plus", "the other", "entries x 1"));
  MatrixXd both(mean_.size(), factor_.cols() + y.factor_.cols());
  both << factor_, y.factor_;
  return GaussianVector(mean_ + y.mean_, both);
}

Expected<GaussianVector> GaussianVector::marginal(std::span<const Index> entries) const {
  FLYBALL_CHECK(check_entries(entries, mean_.size(), "marginal"));
  return mapped(rows_of_identity(entries, mean_.size()));
}

Expected<GaussianPosterior> GaussianVector::conditional(std::span<const Index> entries,
                                                        const VectorXd& values) const {
  constexpr std::string_view where = "conditional";
  FLYBALL_CHECK(check_entries(entries, mean_.size(), where));
  const auto known = static_cast<Index>(entries.size());
  FLYBALL_CHECK(Checks(where)
                    .shape(values, known, 1, "the values", "known entries x 1")
                    .finite(values, "the values"));
  FLYBALL_TRY(auto posterior, given(rows_of_identity(entries, mean_.size()), MatrixXd(known, 0),
                                    values, where, "value"));
  // Known to the last digit.
  VectorXd mean = posterior.estimate.mean_;
  MatrixXd factor = posterior.estimate.factor_;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    mean(entries[i]) = values(static_cast<Index>(i));
    factor.row(entries[i]).setZero();
  }
  posterior.estimate = GaussianVector(std::move(mean), factor);
  return posterior;
}

Expected<GaussianPosterior> GaussianVector::measured(const MatrixRef& C, const MatrixRef& R,
                                                     const VectorXd& y) const {
  constexpr std::string_view where = "measured";
  const Index p = C.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(C, p, mean_.size(), "C", "measurements x entries")
                    .finite(C, "C")
                    .shape(R, p, p, "R", "measurements x measurements")
                    .shape(y, p, 1, "y", "measurements x 1")
                    .finite(y, "y"));
  if (p == 0) {
    return GaussianPosterior{*this};
  }
  FLYBALL_TRY(const auto noise, detail::covariance_factor(R, where, "R"));
  return given(C, noise, y, where, "y");
}

Expected<GaussianPosterior> GaussianVector::given(const MatrixRef& C, const MatrixXd& noise,
                                                  const VectorXd& y, std::string_view where,
                                                  std::string_view name) const {
  const VectorXd expected = detail::product(C, mean_);
  const auto of = detail::measure(factor_, C, noise);
  const VectorXd innovation = y - expected;
  FLYBALL_CHECK(check_difference(innovation, where, name));
  Index contradicted = -1;
  const double distance =
      of.squared_distance(innovation, y.cwiseAbs() + C.cwiseAbs() * mean_.cwiseAbs(), contradicted);
  if (contradicted >= 0) {
    return refusal(GaussianError::contradiction, where,
                   detail::format("{}({})", name, contradicted))
        .got(format_number(y(contradicted)))
        .expected("what is certain of it")
        .hint("give the measurement some noise, or the estimate some doubt")
        .with("difference from the mean", innovation(contradicted));
  }
  return GaussianPosterior{
      .estimate = GaussianVector(mean_ + detail::product(of.K, innovation), of.factor),
      .squared_distance = distance,
      .rank = of.rank,
      .log_evidence =
          -0.5 * (distance + of.log_determinant + static_cast<double>(of.rank) * log_two_pi)};
}

Expected<GaussianPosterior> fuse(const GaussianVector& a, const GaussianVector& b) {
  constexpr std::string_view where = "fuse";
  const Index n = a.mean().size();
  FLYBALL_CHECK(
      check_shape(b.mean(), n, 1, where, "the second vector", "entries of the first x 1"));
  auto fused = a.measured(MatrixXd::Identity(n, n), b.covariance(), b.mean());
  if (!fused) {
    return tl::unexpected(std::move(fused).error().in(std::string(where)));
  }
  return fused;
}

}  // namespace flyball
