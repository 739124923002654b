#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <flyball/classical/transfer_function.hpp>

namespace flyball::classical {

/// Where |L| = 1.
struct GainCrossing {
  double frequency = 0.0;     ///< rad/s
  double phase_margin = 0.0;  ///< deg, 180 + arg L in (-180, 180].
};

/// Where L is real and negative, at zero frequency and at the border's end, too.
struct PhaseCrossing {
  double frequency = 0.0;    ///< rad/s; ∞ where L(∞) is negative.
  double gain_margin = 0.0;  ///< 1/|L|
};

/// The largest of a gain over all frequencies.
struct Peak {
  double value = 0.0;      ///< ∞ where it has no bound.
  double frequency = 0.0;  ///< rad/s; ∞ where it is approached only.
};

/// How far a loop 1/(1 + L) is from instability, whole.
struct LoopMargins {
  std::vector<GainCrossing> gain_crossings{};  ///< By frequency.
  /// By frequency; of a loop with a delay those up to ten times its fastest pole or zero, the first
  /// thousand at most.
  std::vector<PhaseCrossing> phase_crossings{};
  /// The gain margin nearest to one, as a ratio, or 1/|L(∞)| that a direct path behind dead time
  /// comes as near to as one likes; none without a phase crossing.
  std::optional<double> gain_margin{};
  /// deg, that nearest to zero; none without a gain crossing.
  std::optional<double> phase_margin{};
  /// The closed loop: no pole in the right half-plane or on its border, and no chain of them that
  /// tends to it (`rightmost_poles`).
  bool stable = false;
  int unstable_poles = 0;  ///< The largest integer: infinitely many.
  /// s, further delay that a stable loop bears; ∞ if any, 0 of an unstable one.
  double delay_margin = 0.0;
  /// α = 2/‖S - T‖∞ of a stable loop; 0 of an unstable one. This and the peaks are NaN where the
  /// work that is allowed does not bound them: dead time that turns very many times.
  double disk_margin = 0.0;
  Peak sensitivity{};    ///< max |1/(1 + L)| over the frequencies, stable or not.
  Peak complementary{};  ///< max |L/(1 + L)|.
};

/// Margins by polynomial equations in ω² in 31 digits, so that none is missed and each is a
/// crossing to rounding; of discrete loops by w = (z - 1)/(z + 1), up to and including Nyquist.
/// Dead time is exact: gain crossings do not see it, phase crossings are found between the
/// stationary points of the phase, stability by counting the crossings of the imaginary axis as the
/// delay grows.
/// @param loop  L, opened anywhere; negative feedback.
/// @errors ArgumentError::out_of_range for an order, periods of delay counted, above 60;
/// SystemError::no_convergence. Cost: O(n³) in 31 digits, some milliseconds for order 20.
/// Source: book, sections E.3.6 and 7.7.2; Walton and Marshall, "Direct method for TDS stability
/// analysis", IEE Proceedings D 134 (1987); Seiler, Packard and Gahinet, "An introduction to disk
/// margins", IEEE Control Systems Magazine 40 (2020).
[[nodiscard]] Expected<LoopMargins> loop_margins(const TransferFunction& loop);

/// The first frequency, rad/s, at which |G| falls below |G(0)| by the factor; none if it never
/// does, or G(0) is zero or infinite.
/// @param factor  10^(-3/20) unless told, -3 dB. @errors As `loop_margins`.
[[nodiscard]] Expected<std::optional<double>> bandwidth(const TransferFunction& transfer,
                                                        double factor = 0.7079457843841379);

/// max |G| over all frequencies. @errors As `loop_margins`.
[[nodiscard]] Expected<Peak> peak_gain(const TransferFunction& transfer);

}  // namespace flyball::classical
