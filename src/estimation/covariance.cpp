#include <flyball/estimation/covariance.hpp>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

Expected<Eigen::MatrixXd> standard_deviations(std::span<const double> sigmas) {
  constexpr std::string_view where = "standard_deviations";
  if (sigmas.empty()) {
    return refusal(ArgumentError::empty, where, "sigmas")
        .got("empty")
        .expected("one standard deviation a state or output");
  }
  const auto n = static_cast<Eigen::Index>(sigmas.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double sigma = sigmas[static_cast<std::size_t>(i)];
    FLYBALL_CHECK(check_not_negative(sigma, where, detail::format("standard deviation {}", i)));
    covariance(i, i) = sigma * sigma;
  }
  return covariance;
}

Expected<Eigen::MatrixXd> standard_deviations(std::initializer_list<double> sigmas) {
  return standard_deviations(std::span<const double>(sigmas.begin(), sigmas.size()));
}

}  // namespace flyball
