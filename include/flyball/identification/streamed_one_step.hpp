#pragma once

#include <cstddef>

#include <flyball/core/expected.hpp>
#include <flyball/identification/one_step_fit.hpp>
#include <flyball/math/regression/streamed_least_squares.hpp>
#include <flyball/mechanisms/mechanism_kind.hpp>

namespace flyball::identification {

/// `fit_one_step` over rows that come one after the other and are not kept.
class StreamedOneStep {
 public:
  /// @param with_angle  Whether an arm's rows have an angle.
  explicit StreamedOneStep(mechanisms::MechanismKind kind, bool with_angle = true);

  /// @param x  Velocity at a row. @param u  V, until the next. @param angle  rad, of an arm.
  /// @param next  Velocity at the next row. @return  Whether the row was taken: not at rest.
  /// Does not allocate.
  bool add(double x, double u, double angle, double next) noexcept;

  [[nodiscard]] std::size_t rows() const noexcept {
    return static_cast<std::size_t>(regression_.rows());
  }

  /// What the rows so far say. @param period  s, between a row and the next.
  /// @errors IdentificationError::too_short, singular.
  [[nodiscard]] Expected<OneStepFit> fit(double period) const;

 private:
  bool elevator_;
  bool arm_;
  StreamedLeastSquares regression_;
  double mean_ = 0.0;    ///< Of the next velocity.
  double square_ = 0.0;  ///< Σ (next - mean)².
};

}  // namespace flyball::identification
