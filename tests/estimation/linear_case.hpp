#pragma once

#include <Eigen/Core>

#include <flyball/core/random.hpp>
#include <flyball/systems/system.hpp>

// Random linear systems to filter, and what their filter is to say.
namespace flyball::test {

using Plant = DiscreteSystem<3, 1, 2>;
using U = Eigen::Matrix<double, 1, 1>;
using Wide = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// A plant and noises for it: correlated measurement noise, feedthrough, Q of rank two.
struct LinearCase {
  Plant plant;
  Eigen::Matrix3d Q;
  Eigen::Matrix2d R;
  Eigen::Matrix3d P0;
  Eigen::Vector3d x0;
};

[[nodiscard]] Eigen::MatrixXd normal(Random& random, Eigen::Index rows, Eigen::Index columns);
[[nodiscard]] LinearCase linear_case(Random& random);

/// The book's equations (9.20 to 9.24, Joseph's form) in long double.
struct Reference {
  Wide A, B, C, D, Q, R, P, x;
  long double log_likelihood = 0.0L;

  explicit Reference(const LinearCase& c);
  void predict(const U& u);
  void correct(const Eigen::Vector2d& y, const U& u);
};

}  // namespace flyball::test
