#pragma once

#include <flyball/estimation/estimate.hpp>

#include "linear_case.hpp"

namespace flyball::test {

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

}  // namespace flyball::test
