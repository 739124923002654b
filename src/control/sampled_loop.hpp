#pragma once

#include <complex>

#include <flyball/classical/frequency_response.hpp>
#include <flyball/control/margins.hpp>

namespace flyball::detail {

/// A PlantInputLoop after sampling: L(z) = z^{-d} (D_c + C_c (zI - A_c)⁻¹ B_c) C (zI - A)⁻¹
/// (B_0 + B_1/z).
class SampledLoop {
 public:
  [[nodiscard]] static Expected<SampledLoop> create(const PlantInputLoop& loop,
                                                    Time further_delay = Time(0.0));

  /// L(e^{iθ}). @param theta  rad a sample, 0 to π.
  [[nodiscard]] std::complex<double> response(double theta) const;

  /// L as `classical` knows it: states of the plant, a part of a period, and the controller, behind
  /// the whole periods of delay. @param period  The loop's. @errors As `frequency_response`.
  [[nodiscard]] Expected<classical::FrequencyResponse> open(Time period) const;

  /// The closed loop's matrix with a factor on the plant input; its states are the plant's, the
  /// inputs on their way, and the controller's.
  [[nodiscard]] Eigen::MatrixXd closed(double gain) const;

  [[nodiscard]] Eigen::Index plant_states() const noexcept { return A_.rows(); }
  /// States of `closed` before the controller's.
  [[nodiscard]] Eigen::Index delayed_states() const noexcept { return delayed_A_.rows(); }
  [[nodiscard]] const Eigen::MatrixXd& delayed_A() const noexcept { return delayed_A_; }
  [[nodiscard]] const Eigen::MatrixXd& delayed_B() const noexcept { return delayed_B_; }
  [[nodiscard]] const Eigen::MatrixXd& A() const noexcept { return A_; }
  [[nodiscard]] const Eigen::MatrixXd& A_c() const noexcept { return A_c_; }
  [[nodiscard]] double whole_delays() const noexcept { return whole_delays_; }

 private:
  SampledLoop() = default;

  Eigen::MatrixXd A_, B_0_, B_1_, C_;
  double whole_delays_ = 0.0;
  Eigen::MatrixXd A_c_, B_c_, C_c_, D_c_;
  Eigen::MatrixXd delayed_A_, delayed_B_;
};

/// The loops of margins.hpp, with any number of inputs and unchecked.
[[nodiscard]] PlantInputLoop feedback_loop(const MatrixRef& A, const MatrixRef& B,
                                           const MatrixRef& K, Time period, Time delay);
[[nodiscard]] PlantInputLoop observer_loop(const MatrixRef& A, const MatrixRef& B,
                                           const MatrixRef& C, const DiscreteSystem<>& model,
                                           const MatrixRef& K, const MatrixRef& K_e, Time delay);

/// A period, and a delay that is not too many of them.
[[nodiscard]] Expected<void> check_delay(const PlantInputLoop& loop, std::string_view where);
[[nodiscard]] Expected<void> check_loop(const PlantInputLoop& loop, std::string_view where);

[[nodiscard]] double spectral_radius(const Eigen::MatrixXd& M);

}  // namespace flyball::detail
