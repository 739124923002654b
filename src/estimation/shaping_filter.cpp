#include <flyball/estimation/shaping_filter.hpp>

#include <cmath>

#include <flyball/estimation/covariance.hpp>
#include <flyball/math/dense/linear_algebra.hpp>
#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

Expected<void> check_filter(const ShapingFilter& filter, std::string_view where) {
  const Index k = filter.A.rows();
  return Checks(where)
      .square(filter.A, "A of the noise")
      .finite(filter.A, "A of the noise")
      .shape(filter.C, filter.C.rows(), k, "C of the noise", "noises x its states")
      .finite(filter.C, "C of the noise")
      .shape(filter.density.Q, k, k, "the noise's density", "its states x its states")
      .also([&] { return check_covariance(filter.density.Q, where, "the noise's density"); });
}

}  // namespace

Expected<ShapingFilter> first_order_gauss_markov(double sigma, Time correlation_time) {
  constexpr std::string_view where = "first_order_gauss_markov";
  const double T = correlation_time.si();
  return Checks(where).positive(sigma, "sigma").positive(T, "the correlation time", "s").map([&] {
    return ShapingFilter{scalar(-1.0 / T), {scalar(2.0 * sigma * sigma / T)}, scalar(1.0)};
  });
}

Expected<ShapingFilter> second_order_gauss_markov(double sigma, AngularVelocity natural_frequency,
                                                  double damping) {
  constexpr std::string_view where = "second_order_gauss_markov";
  const double omega = natural_frequency.si();
  return Checks(where)
      .positive(sigma, "sigma")
      .positive(omega, "the natural frequency", "rad/s")
      .positive(damping, "the damping")
      .map([&] {
        const double q = 4.0 * damping * std::pow(omega, 3) * sigma * sigma;
        return ShapingFilter{Eigen::Matrix2d{{0.0, 1.0}, {-omega * omega, -2.0 * damping * omega}},
                             {Eigen::Matrix2d{{0.0, 0.0}, {0.0, q}}},
                             Eigen::RowVector2d(1.0, 0.0)};
      });
}

Expected<ShapingFilter> wiener_process(double density) {
  return Checks("wiener_process").positive(density, "the density").map([&] {
    return ShapingFilter{scalar(0.0), {scalar(density)}, scalar(1.0)};
  });
}

Expected<MatrixXd> stationary_autocovariance(const ShapingFilter& filter, double lag) {
  constexpr std::string_view where = "stationary_autocovariance";
  FLYBALL_CHECK(check_filter(filter, where));
  FLYBALL_CHECK(check_not_negative(lag, where, "the lag", "s"));
  const Eigen::VectorXcd poles = detail::eigenvalues_of(filter.A);
  Index place = 0;
  if (!(poles.real().maxCoeff(&place) < 0.0)) {
    return refusal(ArgumentError::out_of_range, where, "the noise")
        .got("not stationary: its variance grows without end")
        .expected("of poles with negative real parts")
        .with("pole", {poles(place).real(), poles(place).imag()});
  }
  FLYBALL_TRY_IN(where, const auto P, lyapunov(filter.A, filter.density.Q));
  FLYBALL_TRY_IN(where, const MatrixXd decay, expm(filter.A.transpose() * lag));
  return detail::product_transposed(
      detail::product(filter.C, detail::product(detail::symmetrized(P.X), decay)), filter.C);
}

Expected<NoisySystem> augment_noise(const ContinuousSystem<>& plant, const ProcessDensity& density,
                                    const ShapingFilter& filter, const MatrixRef& G,
                                    const MatrixRef& F) {
  constexpr std::string_view where = "augment_noise";
  FLYBALL_CHECK(check_system(plant, where));
  FLYBALL_CHECK(check_filter(filter, where));
  const Index n = plant.A.rows();
  const Index m = plant.B.cols();
  const Index p = plant.C.rows();
  const Index k = filter.A.rows();
  const Index q = filter.C.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(density.Q, n, n, "the density", "states x states")
                    .also([&] { return check_covariance(density.Q, where, "the density"); })
                    .shape(G, n, q, "G", "states x noises")
                    .finite(G, "G")
                    .shape(F, p, q, "F", "outputs x noises")
                    .finite(F, "F"));
  NoisySystem result;
  result.plant.A.resize(n + k, n + k);
  result.plant.A << plant.A, detail::product(G, filter.C), MatrixXd::Zero(k, n), filter.A;
  result.plant.B.resize(n + k, m);
  result.plant.B << plant.B, MatrixXd::Zero(k, m);
  result.plant.C.resize(p, n + k);
  result.plant.C << plant.C, detail::product(F, filter.C);
  result.plant.D = plant.D;
  result.density.Q = block_diagonal({density.Q, filter.density.Q});
  return result;
}

}  // namespace flyball
