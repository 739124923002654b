#pragma once

#include <complex>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include <flyball/classical/transfer_function.hpp>

/// What linear systems do to sinusoids, whatever they are made of (sections E.3 and E.7).
namespace flyball::classical {

class DelaySystem;

/// A transfer function from one input to one output as a product,
/// gain Π(s - zᵢ)/Π(s - pⱼ) e^{-delay s}, of a discrete one in z with its delay in seconds.
struct Factors {
  Eigen::VectorXcd zeros;  ///< In pairs of conjugates.
  Eigen::VectorXcd poles;
  double gain = 0.0;
  double delay = 0.0;  ///< s
};

/// G(jω), or G(e^{jωT}) for 0 <= ω <= π/T, of any kind of linear system: a value that shares what
/// stands behind it.
class FrequencyResponse {
 public:
  /// What stands behind one; a further kind of system is a further source.
  class Source {
   public:
    /// Where a grid of frequencies may begin.
    struct Hints {
      Eigen::VectorXcd places;  ///< In s, near which the response is steep.
      double delay = 0.0;       ///< s, the longest.
    };

    Source() = default;
    Source(const Source&) = delete;
    Source& operator=(const Source&) = delete;
    virtual ~Source() = default;

    [[nodiscard]] virtual Eigen::Index outputs() const = 0;
    [[nodiscard]] virtual Eigen::Index inputs() const = 0;
    /// Of a discrete system; none of a continuous one.
    [[nodiscard]] virtual std::optional<Time> period() const = 0;
    /// G column by column at each frequency, rad/s, the results one under the other;
    /// not finite at a pole on the axis.
    /// @param values  outputs·inputs numbers a frequency.
    virtual void evaluate(const Eigen::VectorXd& frequencies,
                          std::complex<double>* values) const = 0;
    /// G at a point of the s plane, a discrete one at z = e^{sT}; NaN where only the axis is known.
    [[nodiscard]] virtual Eigen::MatrixXcd at_point(std::complex<double> s) const = 0;
    /// One entry as a product, where it is one; the phase and the grid are then known exactly.
    [[nodiscard]] virtual std::optional<Factors> factors(Eigen::Index output,
                                                         Eigen::Index input) const;
    /// Of one without factors.
    [[nodiscard]] virtual Hints hints() const;
    /// The frequencies of which anything is known, increasing; empty where all are.
    [[nodiscard]] virtual Eigen::VectorXd known_frequencies() const;
  };

  /// Of anything that has one. @param source  Not null.
  explicit FrequencyResponse(std::shared_ptr<const Source> source) : source_(std::move(source)) {}

  [[nodiscard]] Eigen::Index outputs() const { return source_->outputs(); }
  [[nodiscard]] Eigen::Index inputs() const { return source_->inputs(); }
  [[nodiscard]] std::optional<Time> period() const { return source_->period(); }
  /// rad/s: π/T of a discrete system, ∞ of a continuous one.
  [[nodiscard]] double highest_frequency() const;
  /// outputs x inputs, at ω in rad/s; not finite at a pole on the axis.
  [[nodiscard]] Eigen::MatrixXcd at(double frequency) const;
  /// The same at many, much faster than one by one: a column a frequency, of the entries of G
  /// column by column.
  /// A state space answers within 1e-12 of its largest entry at each frequency (of a discrete one
  /// at e^{jωT} to 19 digits).
  /// @param frequencies  rad/s, of either sign.
  /// @errors ArgumentError::not_finite; out_of_range beyond π/T, or beyond what is known.
  [[nodiscard]] Expected<Eigen::MatrixXcd> sample(const Eigen::VectorXd& frequencies) const;
  [[nodiscard]] Eigen::MatrixXcd at_point(std::complex<double> s) const {
    return source_->at_point(s);
  }
  [[nodiscard]] std::optional<Factors> factors(Eigen::Index output = 0,
                                               Eigen::Index input = 0) const {
    return source_->factors(output, input);
  }
  [[nodiscard]] Source::Hints hints() const { return source_->hints(); }
  [[nodiscard]] Eigen::VectorXd known_frequencies() const { return source_->known_frequencies(); }
  /// From one input to one output. @errors ArgumentError::out_of_range.
  [[nodiscard]] Expected<FrequencyResponse> entry(Eigen::Index output, Eigen::Index input) const;

 private:
  std::shared_ptr<const Source> source_;
};

/// @errors SystemError::no_convergence where the roots of its polynomials are not found.
[[nodiscard]] Expected<FrequencyResponse> frequency_response(const TransferFunction& transfer);
/// C(jωI - A)⁻¹B + D through the Hessenberg form of A. A system of no states is a gain.
/// @param delay  s, dead time of the whole. @errors ArgumentError for the system and the delay.
/// Cost: O(n³), then O(n²) a frequency. Source: Laub, "Efficient multivariable frequency response
/// computations", IEEE Trans. Automatic Control 26 (1981).
[[nodiscard]] Expected<FrequencyResponse> frequency_response(const ContinuousSystem<>& system,
                                                             Time delay = Time(0.0));
[[nodiscard]] Expected<FrequencyResponse> frequency_response(const DiscreteSystem<>& system,
                                                             Time delay = Time(0.0));

/// Of a system with dead time anywhere in it, exact; its factors are not known.
/// Cost: O((n + delays)³) a frequency.
[[nodiscard]] Expected<FrequencyResponse> frequency_response(const DelaySystem& system);

/// How a grid of frequencies is chosen.
struct FrequencyGridOptions {
  /// rad/s; left out, full decades from below the slowest to above the fastest pole, zero, delay
  /// and crossover of the asymptotes, up to π/T.
  std::optional<double> low{};
  std::optional<double> high{};
  double gain_tolerance = 0.1;   ///< dB, of the gain from straight lines over log ω.
  double phase_tolerance = 0.5;  ///< deg, of the phase.
  int most_points = 5000;
};

/// Frequencies between which gain and phase are straight lines over log ω.
struct FrequencyGrid {
  Eigen::VectorXd frequency;  ///< rad/s, increasing.
  double gain_error = 0.0;    ///< dB, the largest distance seen; above the tolerance only where the
  double phase_error = 0.0;   ///< deg, points ran out, or at a pole or zero on the axis.
};

/// A grid that finds each resonance and notch by itself: it begins at the poles and zeros, as close
/// to each as it is to the axis, and halves the worst interval until gain and phase of each entry
/// are straight to the tolerance, or the points run out.
/// @errors ArgumentError::not_positive, out_of_range for the options; not_finite where the response
///         is finite at none of its frequencies.
/// Cost: three evaluations a point.
[[nodiscard]] Expected<FrequencyGrid> frequency_grid(const FrequencyResponse& response,
                                                     const FrequencyGridOptions& options = {});

/// Gain and phase from one input to one output.
struct BodeCurve {
  Eigen::Index output = 0;
  Eigen::Index input = 0;
  Eigen::VectorXd gain;   ///< |G|
  Eigen::VectorXd phase;  ///< deg, continuous in ω but for poles and zeros on the axis.
};

/// A Bode plot, or a Nichols plot of phase and gain.
struct BodeData {
  Eigen::VectorXd frequency;        ///< rad/s
  std::vector<BodeCurve> curves{};  ///< Input by input, output by output.
};

/// The phase is that of the asymptote at ω → 0, -90° an integrator, less 180° of a negative gain,
/// and from there the sum of what each pole, zero and the delay turn, so that no step of the grid
/// is too long for it. A pole on the axis turns it by -180°, a zero by 180°. Where the factors are
/// not known, it follows the grid from the asymptote.
/// @param frequencies  rad/s, positive, increasing.
/// @errors As `sample`; ArgumentError::out_of_range for the order of the frequencies.
/// Source: book, section E.3.6.
[[nodiscard]] Expected<BodeData> bode(const FrequencyResponse& response,
                                      const Eigen::VectorXd& frequencies);
/// On a grid of its own. @errors As `frequency_grid`.
[[nodiscard]] Expected<BodeData> bode(const FrequencyResponse& response,
                                      const FrequencyGridOptions& options = {});

/// deg, the phase of a product at ω > 0, counted from the asymptote at ω → 0 as in `bode`.
/// @param period  Of a discrete one.
[[nodiscard]] double unwrapped_phase(const Factors& factors, double frequency,
                                     const std::optional<Time>& period = std::nullopt);

}  // namespace flyball::classical
