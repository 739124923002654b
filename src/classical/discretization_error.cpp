#include <flyball/classical/discretization_error.hpp>

#include <algorithm>
#include <cmath>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

Expected<DiscretizationComparison> compare_discretizations(const ContinuousSystem<>& system,
                                                           Time period,
                                                           const VectorXd& frequencies) {
  constexpr std::string_view where = "compare discretizations";
  FLYBALL_CHECK(check_system(system, where));
  FLYBALL_CHECK(check_positive(period.si(), where, "period", "s"));
  if (system.B.cols() != 1 || system.C.rows() != 1) {
    return refusal(ArgumentError::wrong_shape, where, "the system")
        .got(flyball::detail::format("{} x {}", system.C.rows(), system.B.cols()))
        .expected("of one input and one output");
  }
  FLYBALL_TRY(const auto response, frequency_response(system));
  DiscretizationComparison comparison;
  comparison.frequency = frequencies;
  FLYBALL_TRY(const Eigen::MatrixXcd values, response.sample(frequencies));
  comparison.continuous = values.row(0).transpose();
  for (Index k = 0; k < frequencies.size(); ++k) {
    const Complex G = comparison.continuous(k);
    if (!(frequencies(k) > 0.0) || !std::isfinite(G.real()) || !std::isfinite(G.imag())) {
      return refusal(TransferError::at_a_pole, where, "a frequency")
          .got(flyball::detail::format("{} rad/s", frequencies(k)))
          .expected("positive, and not that of a pole");
    }
  }
  using enum ConversionMethod;
  for (const ConversionMethod method : {zoh, foh, tustin, forward_euler, backward_euler, matched}) {
    const auto sampled = convert_to_discrete(system, period, method);
    if (!sampled) {
      continue;
    }
    FLYBALL_TRY(const auto discrete, frequency_response(*sampled));
    FLYBALL_TRY(const Eigen::MatrixXcd row, discrete.sample(frequencies));
    DiscretizedResponse made{method, row.row(0).transpose(), VectorXd(frequencies.size()),
                             VectorXd(frequencies.size())};
    for (Index k = 0; k < frequencies.size(); ++k) {
      const Complex ratio = made.response(k) / comparison.continuous(k);
      made.gain_error(k) = 20.0 * std::log10(std::abs(ratio));
      made.phase_error(k) = std::arg(ratio) * 180.0 / std::numbers::pi;
      made.largest_error = std::max(made.largest_error, std::abs(ratio - 1.0));
    }
    FLYBALL_TRY(made.stable, is_stable(*sampled));
    comparison.methods.push_back(std::move(made));
  }
  std::stable_sort(comparison.methods.begin(), comparison.methods.end(),
                   [](const DiscretizedResponse& a, const DiscretizedResponse& b) {
                     return a.largest_error < b.largest_error;
                   });
  return comparison;
}

Expected<DiscretizationComparison> compare_discretizations(const ContinuousSystem<>& system,
                                                           Time period) {
  FLYBALL_CHECK(check_positive(period.si(), "compare discretizations", "period", "s"));
  constexpr Index points = 200;
  const double end = std::numbers::pi / period.si();
  VectorXd w(points);
  for (Index k = 0; k < points; ++k) {
    w(k) = end * std::pow(10.0, 3.0 * (static_cast<double>(k + 1) / points - 1.0));
  }
  return compare_discretizations(system, period, w);
}

}  // namespace flyball::classical
