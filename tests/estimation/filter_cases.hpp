#pragma once

#include <flyball/estimation/forms/information_form.hpp>
#include <flyball/estimation/forms/square_root_covariance.hpp>
#include <flyball/estimation/forms/ud_covariance.hpp>
#include <flyball/estimation/kalman_filter.tpp>
#include <flyball/estimation/model_filter.hpp>

#include "linear_filter.hpp"

// Every filter of a linear system behind one face, for the laws that all of them obey.
namespace flyball::test {

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

}  // namespace flyball::test
