#pragma once

#include <utility>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>

namespace flyball {

/// A matrix that is handed to a design-time function, or the error of the call that was to make it:
/// `lqr(plant, bryson({0.02, 0.4}), bryson({12.0}))` reports what is wrong with a tolerance without
/// an unpacking at each argument. The tag makes a weight and a covariance different types.
template <class Tag>
class MatrixArgument {
 public:
  // NOLINTBEGIN(google-explicit-constructor): being implicit is its purpose.
  /// A matrix, a matrix expression, or what a design-time function answered.
  template <class Derived>
  MatrixArgument(const Eigen::MatrixBase<Derived>& value) : value_(Eigen::MatrixXd(value)) {}
  MatrixArgument(Eigen::MatrixXd value) : value_(std::move(value)) {}
  MatrixArgument(Expected<Eigen::MatrixXd> value) : value_(std::move(value)) {}
  // NOLINTEND(google-explicit-constructor)

  [[nodiscard]] const Expected<Eigen::MatrixXd>& get() const noexcept { return value_; }

 private:
  Expected<Eigen::MatrixXd> value_;
};

}  // namespace flyball
