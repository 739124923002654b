#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include <flyball/core/random.hpp>
#include <flyball/estimation/forms/information_form.hpp>
#include <flyball/estimation/forms/square_root_covariance.hpp>
#include <flyball/estimation/forms/ud_covariance.hpp>
#include <flyball/estimation/kalman_filter.tpp>
#include <flyball/estimation/model_filter.hpp>

// Every filter of a linear system behind one face, for the laws that all of them obey.
namespace flyball::test {

using Plant = DiscreteSystem<3, 1, 2>;
using Wide = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// A plant and noises for it: correlated measurement noise, feedthrough, Q of rank two.
struct LinearCase {
  Plant plant;
  Eigen::Matrix3d Q;
  Eigen::Matrix2d R;
  Eigen::Matrix3d P0;
  Eigen::Vector3d x0;
};

inline Eigen::MatrixXd normal(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

inline LinearCase linear_case(Random& random) {
  LinearCase c;
  c.plant.A = 0.5 * normal(random, 3, 3);
  c.plant.B = normal(random, 3, 1);
  c.plant.C = normal(random, 2, 3);
  c.plant.D = normal(random, 2, 1);
  c.plant.period = Time(0.1);
  const Eigen::MatrixXd G = normal(random, 3, 2);
  const Eigen::MatrixXd H = normal(random, 2, 2);
  const Eigen::MatrixXd F = normal(random, 3, 3);
  c.Q = G * G.transpose();
  c.R = H * H.transpose() + 0.1 * Eigen::Matrix2d::Identity();
  c.P0 = F * F.transpose() + 0.1 * Eigen::Matrix3d::Identity();
  c.x0 = normal(random, 3, 1);
  return c;
}

using U = Eigen::Matrix<double, 1, 1>;

/// An Estimate in a form, moved by the plant's matrices.
template <template <int> class Form>
struct LinearFilter {
  Estimate<Eigen::Vector3d, Form<3>> estimate;
  Plant plant;
  typename Form<3>::Noise Q;
  MeasurementNoise<2> R;

  explicit LinearFilter(const LinearCase& c)
      : estimate(decltype(estimate)::create(c.x0, Eigen::MatrixXd(c.P0)).value()),
        plant(c.plant),
        Q(c.Q),
        R(c.R) {}
  bool predict(const U& u) noexcept { return flyball::predict(estimate, plant.A, plant.B, u, Q); }
  Correction<2> correct(const Eigen::Vector2d& y, const U& u,
                        const CorrectionOptions& options = {}) noexcept {
    return flyball::correct(estimate, y, plant.C, plant.D, u, R, options);
  }
  Eigen::Vector3d x_hat() const { return estimate.x_hat(); }
  Eigen::Matrix3d P() const { return estimate.P(); }
};

/// A ModelFilter of the plant.
template <class Filter>
struct OfModel {
  Filter filter;

  explicit OfModel(const LinearCase& c)
      : filter(Filter::create(c.plant, Eigen::MatrixXd(c.Q), Eigen::MatrixXd(c.R),
                              {c.x0, Eigen::MatrixXd(c.P0)}, c.plant.period)
                   .value()) {}
  bool predict(const U& u) noexcept { return filter.predict(u); }
  Correction<2> correct(const Eigen::Vector2d& y, const U& u,
                        const CorrectionOptions& options = {}) noexcept {
    return filter.correct(y, u, options);
  }
  Eigen::Vector3d x_hat() const { return filter.x_hat(); }
  Eigen::Matrix3d P() const { return filter.P(); }
};

/// The book's equations (9.20 to 9.24, Joseph's form) in long double.
struct Reference {
  Wide A, B, C, D, Q, R, P, x;
  long double log_likelihood = 0.0L;

  explicit Reference(const LinearCase& c)
      : A(c.plant.A.cast<long double>()),
        B(c.plant.B.cast<long double>()),
        C(c.plant.C.cast<long double>()),
        D(c.plant.D.cast<long double>()),
        Q(c.Q.cast<long double>()),
        R(c.R.cast<long double>()),
        P(c.P0.cast<long double>()),
        x(c.x0.cast<long double>()) {}
  void predict(const U& u) {
    x = (A * x + B * u.cast<long double>()).eval();
    P = (A * P * A.transpose() + Q).eval();
  }
  void correct(const Eigen::Vector2d& y, const U& u) {
    const Wide S = C * P * C.transpose() + R;
    const Wide K = S.llt().solve(C * P).transpose();
    const Wide nu = y.cast<long double>() - C * x - D * u.cast<long double>();
    const Wide I_KC = Wide::Identity(3, 3) - K * C;
    x += K * nu;
    P = (I_KC * P * I_KC.transpose() + K * R * K.transpose()).eval();
    log_likelihood -=
        0.5L * ((nu.transpose() * S.llt().solve(nu))(0, 0) + std::log(S.determinant()) +
                2.0L * std::log(2.0L * std::numbers::pi_v<long double>));
  }
};

}  // namespace flyball::test
